/* What the fixed-point attitude filters do with a quaternion.
 *
 * Computes: the first two rows of the rotation matrix, directions along them and back, small turns.
 *
 * Source: own.
 * Cost: on an AVR some 4 000 cycles together as gcc makes them; mahony_q_avr.c has its own, of the same
 * bits.
 *
 * What it does with bad input: every function is defined for all arguments.  A quaternion that is not of
 * unit length gives rows scaled by its length squared; from a length of 1.4 on they wrap.
 */
#ifndef FACTORLAB_TURNING_Q_H
#define FACTORLAB_TURNING_Q_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* World from body: what is east and what is north in the body's axes. */
struct rows_q {
    int16_t east[3];  /* Q14 */
    int16_t north[3]; /* Q14 */
    int16_t short_of; /* (1 - |q|^2) / 2, Q16 */
};

void rows_q(const int32_t q[4] /* Q30 */, struct rows_q *rows);

/* East and north component of a / |a|, Q14; 0 and nothing written where a is 0. */
uint8_t level_q(const struct rows_q *rows, const int16_t a[3], int16_t east_north[2]);

/* Body components, Q14, of what points east and north, Q14. */
void back_q(const struct rows_q *rows, const int16_t east_north[2], int16_t e[3]);

/* sqrt(a^2 + b^2) within 1.1 %: two chords of the circle. */
uint16_t length_q(int16_t a, int16_t b);

/* One period's turn: q (x) (1, h (1 + |h|^2 / 3)), brought back to unit length.
 *
 * `half` is half the angle, rad, Q32.  16 bits of it turn the quaternion; what is left below stays in `left`,
 * Q24, for the next time.  `short_of` is the length that was missing before, Q16. */
void turn_q(int32_t q[4] /* Q30 */, const int32_t half[3], uint8_t left[3], int16_t short_of);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_TURNING_Q_H */
