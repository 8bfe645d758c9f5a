/* The complementary filter on rotations in fixed point: short term of the gyro, long term of gravity and north.
 *
 * The attitude turns with the gyro; then a share 1 - exp(-dt/tau) of the angle between its vertical and the measured
 * one is closed about the axis across both, and likewise of the heading.  About a single axis that is
 * angle = (1 - a)(angle + w dt) + a * accelerometer.  It is sequential.attitude.ComplementaryAttitude (the double
 * version, same settings and defaults) with numbers of limited length.
 *
 * Source: sequential/attitude/complementary_kernel.py.
 *
 * Arithmetic.  Quaternions are Q30 and every turn is one of unit length: cosine and sine by polynomials of the squared
 * half angle, to 1e-5 of the angle.  The share of n periods is 1 - (1 - share)^n; n periods of the gyro are the n-th
 * power of one.  The length is held by one step of Newton's a sample.
 * Error against double: tests/firmware/test_complementary_q.py.  Cost: firmware/budget.csv.
 *
 * What it does with bad input.
 * - Accelerometer all zero: the gyro alone.  Free fall, saturation: only the direction counts, times dt / tau.
 * - Gyro stuck at b: the angles are off by b tau.  Beyond 0.9 rad a period and axis (5 150 deg/s at 100 Hz): taken as
 *   that.  2 000 deg/s is integrated exactly.
 * - Dropped samples: `periods` says how many periods this sample stands for; its gyro is taken for all of them.  Over
 *   more than a second (or 254 periods) nothing is integrated and nothing corrected.  0: the first sample.
 * - A wrong rate scales the angles between corrections: nothing here can see it.
 * - Magnetometer all zero: no heading correction; the next reading makes up for the time between.
 *   Field within 0.06 deg of vertical: no heading correction.
 * - Any state, sample and number of periods: no undefined behaviour, length back to 1.
 */
#ifndef FACTORLAB_COMPLEMENTARY_Q_H
#define FACTORLAB_COMPLEMENTARY_Q_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As sequential.attitude.ComplementaryAttitude has them. */
struct complementary_q_settings {
    float time_constant;         /* s, tau of roll and pitch */
    float heading_time_constant; /* s, tau of the heading */
};

/* What the settings are at one rate. */
struct complementary_q_derived {
    uint32_t share;         /* of the tilt that one period closes, 1, Q32 */
    uint32_t heading_share; /* of the heading that one period closes, 1, Q32 */
    int32_t half_period;    /* s, Q37 */
    uint8_t pause_periods;  /* nothing is integrated over more, periods */
};

struct complementary_q_state {
    int32_t q[4];          /* world_q_body: w x y z, Q30 */
    uint16_t since_field;  /* since the last field, periods, saturated */
    uint8_t heading_known; /* 1: a field has been seen */
    uint8_t status;        /* COMPLEMENTARY_Q_ACCEL_REJECTED */
};

/* bit of the status: that of frame.h */
#define COMPLEMENTARY_Q_ACCEL_REJECTED 0x02U /* there was no accelerometer */

/* Those of sequential.attitude.ComplementaryAttitude(). */
void complementary_q_defaults(struct complementary_q_settings *settings);

/* For 40 to 1 000 samples a second; settings out of range become the nearest that fit.  In single precision: an AVR
 * takes complementary_q_100hz.h instead. */
void complementary_q_derive(const struct complementary_q_settings *settings, uint16_t rate_hz,
                            struct complementary_q_derived *derived);

/* Level by the accelerometer, yaw 0.  Step then takes the same sample with 0 periods. */
void complementary_q_start(struct complementary_q_state *state, const struct complementary_q_derived *derived,
                           const struct imu_q *first);

/* `periods` of 1 / rate_hz since the last sample: 1, or n after n - 1 that dropped out, or 0 for the first; 255 also
 * stands for more. */
void complementary_q_step(struct complementary_q_state *state, const struct complementary_q_derived *derived,
                          const struct imu_q *sample, uint8_t periods);

/* world_q_body, Q30, of length 1 within 1e-4. */
void complementary_q_attitude(const struct complementary_q_state *state, int32_t world_q_body[4]);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_COMPLEMENTARY_Q_H */
