/* Mahony's filter in single precision: quaternion and gyro bias from gyro, accelerometer and magnetometer.
 *
 * With v the vertical and n north in the body frame, both by the estimate:
 *
 *     e = a/|a| x v (+ heading error along v)     b <- b - k_I e dt     q <- q exp((w - b + k_P e) dt)
 *
 * and what a real board needs: a quick start, a limit on e (accelerations are large and short) that grows by
 * the part of e that lasts in the world's axes, a gate with a timeout on the heading, limits on the bias, and
 * the bias drawn to the gyro's mean while nothing moves.
 *
 * Source: Mahony, Hamel, Pflimlin 2008, Nonlinear complementary filters on the special orthogonal group,
 * equations 32 and 48.  The same filter, step by step, as sequential.attitude.Mahony: from an equal state one
 * step agrees to 1e-6.  R (a x v) = (R a) x z, so that both the error and its lasting part come from two rows
 * of the rotation matrix.
 *
 * Cost: instructions on a Cortex-M4F, -O2, with and without vmla: 9-D 249/303, 6-D 194/233,
 * `mahony_f32_step_published` 103/136; firmware/budget.csv.
 *
 * What it does with bad input
 *   gyro NaN, infinite, above 8192 rad/s   the sample changes nothing at all
 *   accelerometer NaN, infinite, zero   the sample turns by the gyro alone, and time at rest begins anew
 *   accelerometer saturated      its direction is wrong: the limit on e holds the tilt to error_limit * gain
 *   gyro stuck                   looks like rest; no further than bias_limit can it be taken for a bias
 *   2000 deg/s                   integrated to the fifth power of the angle; no bound on the rate
 *   samples dropped out          pass the longer dt: the last reading stands for it, up to 1 s
 *   dt NaN, negative, above 1 s  taken as 0; the quick start begins again
 *   magnetometer NaN or zero     no heading correction; the next good reading stands for 0.2 s at most
 *   field within 0.06 deg of vertical   no heading correction
 */
#ifndef FACTORLAB_MAHONY_F32_H
#define FACTORLAB_MAHONY_F32_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Infinity takes off a limit, a gate or the rest detection.  Defaults are those of sequential.attitude. */
struct mahony_f32_settings {
    float gain;            /* 1/s, k_P of the accelerometer */
    float heading_gain;    /* 1/s, k_P of the magnetometer */
    float integral_gain;   /* 1/s^2, k_I */
    float bias_limit;      /* rad/s, on every axis */
    float error_limit;     /* 1, sine of an angle: e is shortened to this ... */
    float lasting_time;    /* s, ... plus the length of its mean over this time */
    float heading_gate;    /* rad: a heading further off is a magnetic disturbance ... */
    float heading_timeout; /* s, ... until it has been for so long */
    float start_gain;      /* 1/s, k_P begins at this ... */
    float start_time;      /* s, ... and is `gain` after this */
    float rest_gyro;       /* rad/s: at rest no axis departs further from its mean */
    float rest_accel;      /* m/s^2, likewise */
    float rest_time;       /* s of rest before the bias is drawn to the gyro */
    float rest_constant;   /* s, time constant of that */
    uint8_t tilt_by_field; /* 1: the magnetometer corrects roll and pitch too, as published */
    uint8_t order;         /* 1: Euler's step, as published; 3: right to the fifth power of the angle */
};

struct mahony_f32_derived {
    float gains[3];        /* 1/s, 1/s, 1/s^2: twice gain, heading_gain, integral_gain, as rows are halved */
    float bias_limit;      /* rad/s */
    float error_limit;     /* 1 */
    float lasting_time;    /* s */
    float gate_cosine;     /* 1, of heading_gate; -2: no gate */
    float gate_ahead;      /* 1, the same, but no less than 0 */
    float heading_timeout; /* s */
    float boost;           /* 1/s, twice start_gain - gain */
    float start_time;      /* s */
    float start_rate;      /* 1/s, 1 / start_time */
    float rest_time;       /* s */
    float rest_constant;   /* s */
    float third;           /* 1, third-order coefficient of a turn, halved */
    uint32_t rest_gyro;    /* rad/s, as below_f32 takes it */
    uint32_t rest_accel;   /* m/s^2, as below_f32 takes it */
    uint32_t bias_bound;   /* rad/s, bias_limit as below_f32 takes it */
    uint8_t tilt_by_field; /* 1: the magnetometer corrects roll and pitch */
};

struct mahony_f32_state {
    float world_q_body[4]; /* 1, w x y z */
    float gyro_bias[3];    /* rad/s */
    float mean_gyro[3];    /* rad/s, low-passed */
    float mean_accel[3];   /* m/s^2, low-passed */
    float lasting[2];      /* 1, mean of e, east and north */
    float since_start;     /* s, up to start_time */
    float since_field;     /* s since the last field, up to 0.2 */
    float out_of_gate;     /* s, up to one step over heading_timeout */
    float at_rest;         /* s, up to one step over rest_time */
    uint8_t heading_known; /* 1 once a field has been seen */
    uint8_t starting;      /* 1 until start_time has gone by */
};

/* Settings of sequential.attitude.Mahony(). */
void mahony_f32_defaults(struct mahony_f32_settings *settings);

/* Mahony as published: two gains, Euler's step, nothing rejected, no start. */
void mahony_f32_as_published(struct mahony_f32_settings *settings, float gain, float integral_gain);

void mahony_f32_derive(const struct mahony_f32_settings *settings, struct mahony_f32_derived *derived);

/* Level by the accelerometer, yaw 0, no bias.  Step then takes the same sample with dt = 0. */
void mahony_f32_start(struct mahony_f32_state *state, const struct mahony_f32_derived *derived,
                      const struct imu_f32 *first);

/* One sample, dt seconds after the one before; the magnetometer is used where it reads. */
void mahony_f32_step(struct mahony_f32_state *state, const struct mahony_f32_derived *derived,
                     const struct imu_f32 *sample, float dt);

/* The same for a board without magnetometer: `mag` is not looked at. */
void mahony_f32_step_6d(struct mahony_f32_state *state, const struct mahony_f32_derived *derived,
                        const struct imu_f32 *sample, float dt);

/* The filter of the paper alone, 6-D: of the settings gain, integral_gain, bias_limit and order. */
void mahony_f32_step_published(struct mahony_f32_state *state, const struct mahony_f32_derived *derived,
                               const struct imu_f32 *sample, float dt);

void mahony_f32_attitude(const struct mahony_f32_state *state, float world_q_body[4]);

/* Whether nothing moves, for longer than rest_time. */
int mahony_f32_rests(const struct mahony_f32_state *state, const struct mahony_f32_derived *derived);

/* Whether the heading by the field is out of its gate. */
int mahony_f32_disturbed(const struct mahony_f32_state *state);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_MAHONY_F32_H */
