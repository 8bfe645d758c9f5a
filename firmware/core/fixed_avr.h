/* The products of fixed_q.h in AVR assembler: bit for bit those of the C beside them.  Included by fixed_q.h
 * only.
 *
 * `a0` is the lowest byte; a product of two bytes comes in r1:r0, and r1 is 0 again when gcc goes on.  What
 * a byte product adds above its own two bytes is carried to the end of the accumulator.  mulsu (signed times
 * unsigned) leaves the sign in the carry, and takes registers r16 to r23 only: constraint "a".
 */
#ifndef FACTORLAB_FIXED_AVR_H
#define FACTORLAB_FIXED_AVR_H

#include <stdint.h>

/* a b: 19 cycles. */
static inline __attribute__((always_inline)) int32_t mul16_q(int16_t a, int16_t b)
{
    int32_t product;
    uint8_t zero;
    __asm__("clr  %[z]          \n\t"
            "muls %B[a], %B[b]  \n\t"
            "movw %C[p], r0     \n\t"
            "mul  %A[a], %A[b]  \n\t"
            "movw %A[p], r0     \n\t"
            "mulsu %B[a], %A[b] \n\t"
            "sbc  %D[p], %[z]   \n\t"
            "add  %B[p], r0     \n\t"
            "adc  %C[p], r1     \n\t"
            "adc  %D[p], %[z]   \n\t"
            "mulsu %B[b], %A[a] \n\t"
            "sbc  %D[p], %[z]   \n\t"
            "add  %B[p], r0     \n\t"
            "adc  %C[p], r1     \n\t"
            "adc  %D[p], %[z]   \n\t"
            "clr  r1            \n\t"
            : [p] "=&r"(product), [z] "=&r"(zero)
            : [a] "a"(a), [b] "a"(b)
            : "r0");
    return product;
}

/* a b: 17 cycles. */
static inline __attribute__((always_inline)) int32_t mul16u_q(int16_t a, uint16_t b)
{
    int32_t product;
    uint8_t zero;
    __asm__("clr  %[z]          \n\t"
            "mulsu %B[a], %B[b] \n\t"
            "movw %C[p], r0     \n\t"
            "mul  %A[a], %A[b]  \n\t"
            "movw %A[p], r0     \n\t"
            "mulsu %B[a], %A[b] \n\t"
            "sbc  %D[p], %[z]   \n\t"
            "add  %B[p], r0     \n\t"
            "adc  %C[p], r1     \n\t"
            "adc  %D[p], %[z]   \n\t"
            "mul  %A[a], %B[b]  \n\t"
            "add  %B[p], r0     \n\t"
            "adc  %C[p], r1     \n\t"
            "adc  %D[p], %[z]   \n\t"
            "clr  r1            \n\t"
            : [p] "=&r"(product), [z] "=&r"(zero)
            : [a] "a"(a), [b] "a"(b)
            : "r0");
    return product;
}

/* a b / 2^16, rounded: 21 cycles. */
static inline __attribute__((always_inline)) uint16_t mulu16_q(uint16_t a, uint16_t b)
{
    uint16_t product;
    uint8_t zero;
    uint8_t below; /* byte 1 of the product: its highest bit rounds */
    __asm__("clr  %[z]         \n\t"
            "mul  %A[a], %A[b] \n\t"
            "mov  %[t], r1     \n\t"
            "mul  %B[a], %B[b] \n\t"
            "movw %A[p], r0    \n\t"
            "mul  %B[a], %A[b] \n\t"
            "add  %[t], r0     \n\t"
            "adc  %A[p], r1    \n\t"
            "adc  %B[p], %[z]  \n\t"
            "mul  %A[a], %B[b] \n\t"
            "add  %[t], r0     \n\t"
            "adc  %A[p], r1    \n\t"
            "adc  %B[p], %[z]  \n\t"
            "lsl  %[t]         \n\t"
            "adc  %A[p], %[z]  \n\t"
            "adc  %B[p], %[z]  \n\t"
            "clr  r1           \n\t"
            : [p] "=&r"(product), [z] "=&r"(zero), [t] "=&r"(below)
            : [a] "r"(a), [b] "r"(b)
            : "r0");
    return product;
}

/* a b / 2^16, rounded: 46 cycles. */
static inline __attribute__((always_inline)) int32_t mul32u16_q(int32_t a, uint16_t b)
{
    int32_t product;
    uint8_t zero;
    uint8_t below; /* byte 1 of the product: its highest bit rounds */
    __asm__("clr  %[z]          \n\t"
            "mul  %A[a], %A[b]  \n\t"
            "mov  %[t], r1      \n\t"
            "mul  %B[a], %B[b]  \n\t"
            "movw %A[p], r0     \n\t"
            "mulsu %D[a], %B[b] \n\t"
            "movw %C[p], r0     \n\t"
            "mul  %A[a], %B[b]  \n\t"
            "add  %[t], r0      \n\t"
            "adc  %A[p], r1     \n\t"
            "adc  %B[p], %[z]   \n\t"
            "adc  %C[p], %[z]   \n\t"
            "adc  %D[p], %[z]   \n\t"
            "mul  %B[a], %A[b]  \n\t"
            "add  %[t], r0      \n\t"
            "adc  %A[p], r1     \n\t"
            "adc  %B[p], %[z]   \n\t"
            "adc  %C[p], %[z]   \n\t"
            "adc  %D[p], %[z]   \n\t"
            "mul  %C[a], %A[b]  \n\t"
            "add  %A[p], r0     \n\t"
            "adc  %B[p], r1     \n\t"
            "adc  %C[p], %[z]   \n\t"
            "adc  %D[p], %[z]   \n\t"
            "mulsu %D[a], %A[b] \n\t"
            "sbc  %D[p], %[z]   \n\t"
            "add  %B[p], r0     \n\t"
            "adc  %C[p], r1     \n\t"
            "adc  %D[p], %[z]   \n\t"
            "mul  %C[a], %B[b]  \n\t"
            "add  %B[p], r0     \n\t"
            "adc  %C[p], r1     \n\t"
            "adc  %D[p], %[z]   \n\t"
            "lsl  %[t]          \n\t"
            "adc  %A[p], %[z]   \n\t"
            "adc  %B[p], %[z]   \n\t"
            "adc  %C[p], %[z]   \n\t"
            "adc  %D[p], %[z]   \n\t"
            "clr  r1            \n\t"
            : [p] "=&r"(product), [z] "=&r"(zero), [t] "=&r"(below)
            : [a] "a"(a), [b] "a"(b)
            : "r0");
    return product;
}

/* a b / 2^16, rounded: 52 cycles. */
static inline __attribute__((always_inline)) int32_t mul32x16_q(int32_t a, int16_t b)
{
    int32_t product = mul32u16_q(a, (uint16_t)b);
    return b < 0 ? (int32_t)((uint32_t)product - (uint32_t)a) : product;
}

/* a b / 2^32, rounded: 140 cycles with the call, for it is long (fixed_q.c). */
int32_t mul32_q(int32_t a, int32_t b);

#endif /* FACTORLAB_FIXED_AVR_H */
