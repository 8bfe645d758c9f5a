/* The complementary filter on rotations: short term of the gyro, long term of gravity and north.
 *
 * The attitude turns with the gyro; then a share 1 - exp(-dt/tau) of the angle between its vertical and the
 * measured one is closed about the axis across both, and likewise of the heading.  About a single axis that
 * is angle = (1 - a)(angle + w dt) + a * accelerometer.
 *
 * Source: the same filter, step by step, as sequential.attitude.ComplementaryAttitude; from an equal state
 * one step agrees to 1e-6.
 *
 * Cost: firmware/budget.csv.
 *
 * What it does with bad input
 *   gyro NaN, infinite, above 8192 rad/s   the sample changes nothing at all
 *   accelerometer NaN, infinite, zero   the sample turns by the gyro alone
 *   accelerometer saturated      its direction is wrong by what it is wrong, times dt/tau
 *   gyro stuck at b              the angles are off by b * tau
 *   2000 deg/s                   integrated exactly; no bound on the rate
 *   samples dropped out          pass the longer dt: the last reading stands for it, up to 1 s
 *   dt NaN, negative, above 1 s  taken as 0
 *   magnetometer NaN or zero     no heading correction; the next good reading makes up for the time between
 *   field within 0.06 deg of vertical   no heading correction
 */
#ifndef FACTORLAB_COMPLEMENTARY_F32_H
#define FACTORLAB_COMPLEMENTARY_F32_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

struct complementary_f32_settings {
    float time_constant;         /* s, tau of roll and pitch */
    float heading_time_constant; /* s, tau of the heading */
};

struct complementary_f32_derived {
    float rate;         /* 1/s, 1 / time_constant */
    float heading_rate; /* 1/s, 1 / heading_time_constant */
};

struct complementary_f32_state {
    float world_q_body[4]; /* 1, w x y z */
    float since_field;     /* s since the last field */
    uint8_t heading_known; /* 1 once a field has been seen */
};

/* Settings of sequential.attitude.ComplementaryAttitude(). */
void complementary_f32_defaults(struct complementary_f32_settings *settings);

void complementary_f32_derive(const struct complementary_f32_settings *settings,
                              struct complementary_f32_derived *derived);

/* Level by the accelerometer, yaw 0.  Step then takes the same sample with dt = 0. */
void complementary_f32_start(struct complementary_f32_state *state,
                             const struct complementary_f32_derived *derived, const struct imu_f32 *first);

/* One sample, dt seconds after the one before; the magnetometer is used where it reads. */
void complementary_f32_step(struct complementary_f32_state *state,
                            const struct complementary_f32_derived *derived, const struct imu_f32 *sample,
                            float dt);

void complementary_f32_attitude(const struct complementary_f32_state *state, float world_q_body[4]);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_COMPLEMENTARY_F32_H */
