/* Angles in fixed point: atan2, asin, sine, and the roll, pitch and yaw of a quaternion.
 *
 * Angles are binary: 2^16 (or 2^32) stand for 360 degrees, so that they wrap as integers do.  atan2 divides the
 * smaller by the larger coordinate (16 bits of quotient) and takes a minimax polynomial of degree 11; the length
 * of the same vector is the larger coordinate times a polynomial of degree 4 in the squared quotient, so that
 * pitch is the atan2 of a sine and a cosine and keeps its precision up to 90 degrees.
 *
 * Source: own; the polynomials were fitted by Lawson's reweighted least squares (Lawson 1961).
 * Error: measured by tests/firmware/test_trig_q.py, rounding to 2^-16 of a turn (0.0027 deg) included:
 *     atan2_q 0.0042 deg; atan2_q32 0.0017 deg; asin_q 0.0055 deg; sincos_q 9e-6; angles_q 0.0046 deg
 * Cost: AVR -Os, see firmware/budget.csv.
 *
 * What it does with bad input: every argument is allowed.  atan2 of (0, 0) is 0; asin of a sine beyond +-1 is
 * +-90 degrees.  At a pitch of +-90 degrees roll and yaw are those of rounding errors, as their definition is.
 * A quaternion that is not of unit length, or zero, gives the angles of its direction as if it were: garbage,
 * but in range; the filters keep the length.
 */
#ifndef FACTORLAB_TRIG_Q_H
#define FACTORLAB_TRIG_Q_H

#include <stdint.h>

#include "fixed_q.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Angle of the vector (x, y), any scale: 65536 = 360 deg. */
int16_t atan2_q(int32_t y, int32_t x);

/* The same: 2^32 = 360 deg. */
uint32_t atan2_q32(int32_t y, int32_t x);

/* The same, and the vector's length: relative error 4e-5; up to 3.04e9, where it needs the 32nd bit. */
uint32_t polar_q32(int32_t y, int32_t x, uint32_t *length);

/* Arc sine of a Q30: 65536 = 360 deg. */
int16_t asin_q(int32_t sine);

/* Sine and cosine, Q30, of an angle: 2^32 = 360 deg.  Relative error 9e-6: small angles stay what they are. */
void sincos_q(uint32_t angle, int32_t *sine, int32_t *cosine);

/* cos(x), Q30, and 1 - sin(x)/x, Q18, of x^2 in Q32, |x| < 1: for a vector, of which that is all one knows. */
int32_t cosine_q(uint32_t square, uint16_t *shortage);

/* x times sin/x: a component of the vector that cosine_q was asked about. */
static inline int32_t shortened_q(int32_t x, uint16_t shortage)
{
    return x - ((mul32u16_q(x, shortage) + 2) >> 2);
}

/* Angles of R = Rz(yaw) Ry(pitch) Rx(roll); roll and yaw in [-180, 180[ deg, pitch in [-90, 90] deg. */
void angles_q(const int32_t world_q_body[4] /* Q30 */, int16_t roll_pitch_yaw[3] /* 65536 = 360 deg */);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_TRIG_Q_H */
