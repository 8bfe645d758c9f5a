/* Sine, cosine, arctangent and decay in single precision, without libm.
 *
 * Source: own minimax polynomials (Lawson's weighted least squares), of the odd or even part on a reduced
 * range.  Largest errors, over every float of the range: firmware/core is tested to these.
 *
 *     atan2_f32     3e-7 rad
 *     sin_cos_f32   1e-7, for angles within 1000 rad of zero
 *     wrapped_f32   the rounding of the angle
 *     decay_f32     2e-7
 *
 * Cost: firmware/budget.csv.
 *
 * What it does with bad input: NaN gives NaN; atan2 of (0, 0) is 0, of infinities NaN.  An angle further
 * than 1e4 rad from zero, of which single precision does not hold the turns, counts as 0.
 */
#ifndef FACTORLAB_TRIG_F32_H
#define FACTORLAB_TRIG_F32_H

#ifdef __cplusplus
extern "C" {
#endif

#define PI_F32 3.14159265f /* rad */

/* The angle of (x, y), rad in [-pi, pi]. */
float atan2_f32(float y, float x);

void sin_cos_f32(float angle, float *sine, float *cosine);

/* The same angle in [-pi, pi], rad. */
float wrapped_f32(float angle);

/* 1 - exp(-x) for x >= 0: the share by which something comes nearer in x time constants. */
float decay_f32(float x);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_TRIG_F32_H */
