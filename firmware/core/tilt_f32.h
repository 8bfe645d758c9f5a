/* The tilt Kalman filter in single precision: roll, pitch and yaw, each an angle with the bias of its rate.
 *
 * Each channel predicts with the rate u of its angle and corrects with the angle z that gravity, or the field
 * levelled by roll and pitch, gives:
 *
 *     angle <- angle + (u - b) dt,   F = [1 -dt; 0 1],   Q of white noise and bias walk,   z = angle + noise
 *
 * Source: the two-state filter of textbooks (Kalman 1960), the same step by step as
 * sequential.attitude.TiltKalman; from an equal state one step agrees to 1e-6.  u is the gyro turned into
 * rates of the angles, so the biases are those of these rates; over a pitch of 90 degrees the angles fold.
 *
 * Cost: firmware/budget.csv.
 *
 * What it does with bad input
 *   gyro NaN, infinite, above 8192 rad/s   the sample changes nothing at all
 *   accelerometer NaN, infinite, zero   predicted, not corrected: the variances grow
 *   accelerometer saturated      a wrong angle; beyond the gate it is refused
 *   gyro stuck                   its rate is a bias, drawn to at the pace that bias_walk says
 *   2000 deg/s                   Euler's step on the angles: half the turn of one sample off at most
 *   samples dropped out          pass the longer dt: the last reading stands for it, up to 1 s
 *   dt NaN, negative, above 1 s  taken as 0, and the angles' variances begin anew
 *   magnetometer NaN or zero     yaw is predicted, not corrected
 *   pitch of +-90 deg            rates of roll and yaw are divided by 0.05 at least
 */
#ifndef FACTORLAB_TILT_F32_H
#define FACTORLAB_TILT_F32_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

struct tilt_f32_settings {
    float gyro_density;  /* rad/s/sqrt(Hz), white noise of the rates */
    float bias_walk;     /* rad/s^2/sqrt(Hz), random walk of the biases */
    float tilt_sigma;    /* rad, of roll and pitch by the accelerometer */
    float heading_sigma; /* rad, of yaw by the magnetometer */
    float nis_gate;      /* 1, largest squared innovation over its variance; infinity: no gate */
    float bias_sigma;    /* rad/s, of the biases before the first sample */
};

struct tilt_f32_derived {
    float gyro_power;         /* rad^2/s */
    float bias_power;         /* rad^2/s^3 */
    float bias_power_third;   /* rad^2/s^3, a third of that */
    float tilt_variance;      /* rad^2 */
    float heading_variance;   /* rad^2 */
    float nis_gate;           /* 1 */
    float first_variance;     /* (rad/s)^2, of an unknown bias */
};

struct tilt_f32_state {
    float angle[3];          /* rad, roll pitch yaw */
    float bias[3];           /* rad/s, of their rates */
    float angle_variance[3]; /* rad^2 */
    float covariance[3];     /* rad^2/s, of angle and bias */
    float bias_variance[3];  /* (rad/s)^2 */
    uint8_t heading_known;   /* 1 once a field has been seen */
};

/* Settings of sequential.attitude.TiltKalman(). */
void tilt_f32_defaults(struct tilt_f32_settings *settings);

void tilt_f32_derive(const struct tilt_f32_settings *settings, struct tilt_f32_derived *derived);

/* The angles of the accelerometer, yaw 0.  Step then takes the same sample with dt = 0. */
void tilt_f32_start(struct tilt_f32_state *state, const struct tilt_f32_derived *derived,
                    const struct imu_f32 *first);

/* One sample, dt seconds after the one before; the magnetometer is used where it reads. */
void tilt_f32_step(struct tilt_f32_state *state, const struct tilt_f32_derived *derived,
                   const struct imu_f32 *sample, float dt);

void tilt_f32_attitude(const struct tilt_f32_state *state, float world_q_body[4]);

/* The biases about the body's axes, rad/s. */
void tilt_f32_gyro_bias(const struct tilt_f32_state *state, float gyro_bias[3]);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_TILT_F32_H */
