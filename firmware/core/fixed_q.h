/* Fixed-point arithmetic that gives the same bits on every machine.
 *
 * Qn: an integer k stands for k / 2^n.  Formats are shifted by 8, 16, 24 or 32 bits only where a product is
 * narrowed, which costs nothing on an 8-bit machine: bytes are left out.  Narrowing rounds to nearest, ties
 * upwards; what may leave its range saturates or says here why it cannot.
 *
 * Every product exists twice: in portable C (`..._c`), and, on an AVR, in assembler (fixed_avr.h); the tests
 * hold one against the other on every target.  Right shifts of negative numbers are arithmetic, as on every
 * compiler in question (gcc, clang; C99 6.5.7 leaves it to them).
 *
 * Source: own; multiplication by bytes as in Atmel's application note AVR201.
 * Cost: AVR, cycles: mul16 19, mul16u 20, mul32u16 47 (gcc's own 16x16 -> 32: 35, 64 bits:
 * 300).
 *
 * What it does with bad input: every function is defined for all arguments unless its comment gives a range.
 */
#ifndef FACTORLAB_FIXED_Q_H
#define FACTORLAB_FIXED_Q_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* a b, exact. */
static inline int32_t mul16_c(int16_t a, int16_t b) { return (int32_t)a * b; }

/* a b, exact. */
static inline int32_t mul16u_c(int16_t a, uint16_t b) { return (int32_t)((int64_t)a * b); }

/* a b / 2^16, rounded. */
static inline uint16_t mulu16_c(uint16_t a, uint16_t b)
{
    return (uint16_t)(((uint32_t)a * b + 0x8000U) >> 16);
}

/* a b / 2^16, rounded. */
static inline int32_t mul32u16_c(int32_t a, uint16_t b) { return (int32_t)(((int64_t)a * b + 0x8000) >> 16); }

/* a b / 2^16, rounded; |a b| < 2^47 - 2^15. */
static inline int32_t mul32x16_c(int32_t a, int16_t b) { return (int32_t)(((int64_t)a * b + 0x8000) >> 16); }

/* a b / 2^32, rounded; not for a = b = -2^31. */
static inline int32_t mul32_c(int32_t a, int32_t b) { return (int32_t)(((int64_t)a * b + 0x80000000) >> 32); }

#ifdef __AVR__
#include "fixed_avr.h"
#else
#define mul16_q mul16_c
#define mul16u_q mul16u_c
#define mulu16_q mulu16_c
#define mul32u16_q mul32u16_c
#define mul32x16_q mul32x16_c
#define mul32_q mul32_c
#endif

/* a + b, a - b, a 2^n modulo 2^32: for what stays in range unless a caller's state makes no sense. */
static inline int32_t plus_q(int32_t a, int32_t b) { return (int32_t)((uint32_t)a + (uint32_t)b); }
static inline int32_t minus_q(int32_t a, int32_t b) { return (int32_t)((uint32_t)a - (uint32_t)b); }
static inline int32_t up_q(int32_t a, uint8_t n) { return (int32_t)((uint32_t)a << n); }

/* Whether |x| <= limit, 0 <= limit < 2^30. */
static inline uint8_t within_q(int32_t x, int32_t limit)
{
    return (uint32_t)x + (uint32_t)limit <= 2U * (uint32_t)limit;
}

/* a + b, saturated. */
static inline int32_t add_q(int32_t a, int32_t b)
{
    int32_t sum = (int32_t)((uint32_t)a + (uint32_t)b);
    if (((a ^ sum) & (b ^ sum)) < 0) {
        return a < 0 ? INT32_MIN : INT32_MAX;
    }
    return sum;
}

/* x, kept within +-limit; limit >= 0. */
static inline int32_t clamp_q(int32_t x, int32_t limit)
{
    if (x > limit) {
        return limit;
    }
    return x < -limit ? -limit : x;
}

/* x as 16 bits, saturated. */
static inline int16_t narrow_q(int32_t x)
{
    if (x > INT16_MAX) {
        return INT16_MAX;
    }
    return x < INT16_MIN ? INT16_MIN : (int16_t)x;
}

/* x / 2^16, rounded; modulo 2^16 from 2^31 - 2^15 on. */
static inline int16_t high16_q(int32_t x) { return (int16_t)(plus_q(x, 0x8000) >> 16); }

/* |x|, which fits: x > -2^31. */
static inline int32_t abs_q(int32_t x) { return x < 0 ? -x : x; }

/* 2^31 / sqrt(x) for 2^30 <= x < 2^32: too small by 1 part in 1 800 to 28 000. */
uint16_t inverse_sqrt_q(uint32_t x);

extern const uint16_t inverse_roots_q[49]; /* in flash, see flash.h */

/* sqrt(x): too small by at most 1 part in 1 600 and 1. */
uint16_t sqrt_q(uint32_t x);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_FIXED_Q_H */
