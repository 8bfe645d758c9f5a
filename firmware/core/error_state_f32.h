/* Error-state attitude filter in single precision: inclination, heading and gyro bias with covariances.
 *
 * The gyro is integrated at every sample.  Once a `block` of time two Kalman filters on the error correct it:
 *
 *     inclination   theta (3), bias (3), horizontal velocity (2) and position (2).  The mean specific force f
 *                   of the block, turned to the frame of the gyro, moves v and p, and f + 2 a v + a^2 p is
 *                   white noise whose level follows the data.  At rest the gyro reads its bias.
 *     heading       delta, reference field (north, up), hard iron (3), delay of the magnetometer.  The mean
 *                   field of the block is (0, north, up) + delta (north, 0, 0) + R iron + delay (w x field),
 *                   trusted the less the farther its strength and dip are from the reference.
 *
 * The heading changes neither inclination nor bias.  The drift of the gyro's frame about the vertical is
 * considered, not corrected (Schmidt), so that the answer without magnetometer is there as well.
 *
 * Source: Sola 2017, Quaternion kinematics for the error-state Kalman filter, section 7 (global error);
 * Schmidt 1966 for what is considered only; Laidig and Seel 2023, VQF, for motion that stays bounded.
 * The same filter as sequential.attitude.ErrorStateAttitude, whose docstring tells what each setting does: on
 * ten trials of BROAD within 0.008 deg RMS of it, covariances within 1e-3.  In single precision: covariances
 * are lower triangles, errors are put into the values as they are found, and the heading is kept as cosine
 * and sine of its half, without trigonometry.  What the field, and the gyro at rest, correct at the end of a
 * block comes with the next sample, so that no update does all the work.
 *
 * Cost, Cortex-M4F, gcc -O2, instructions: 100 Hz 2 160 an update (9-D), 1 540 (6-D), half of that at 286 Hz;
 * 480 within a block, 5 720 at most.  6.1 kB of code, 640 bytes of state, about 500 bytes of stack.
 *
 * What it does with bad input
 *   gyro NaN, infinite, > 1000 rad/s   the sample is passed over; the next one turns for both
 *   accelerometer NaN, infinite, zero, > 11 km/s^2   not in the mean; a block without any forgets velocity
 *                                 and position, and the inclination becomes unsure up to 1 rad
 *   accelerometer saturated       an acceleration like others: the level of the noise rises by itself
 *   accelerometer stuck           trusted; where it contradicts the gyro the level rises
 *   gyro stuck                    at rest_rate or less, with a steady force, it is taken for a bias at rest
 *   2000 deg/s                    integrated to the fifth power of the angle; covariances grow by its scale
 *   force from below for 0.5 s    levelled anew
 *   gap > `gap`                   the block ends; may have turned by half a radian a second, any way; after a
 *                                 long one (0.4 s by default) levelled by the first force
 *   dt NaN or negative            taken as 0; samples without time go into the same means
 *   20 Hz or less                 every sample ends a block; rest and field are a sample late
 *   magnetometer NaN, zero        not in the mean; without any the heading's variance grows
 *   field that repeats bit for bit   no news: a stuck magnetometer is the same as none
 *   field vertical                no heading at the start (0 is taken), little correction after
 *   accelerations beyond all reason (km/s^2) for long   velocity and noise take as long to calm down; a gap
 *                                 longer than `gap` makes them begin anew
 */
#ifndef FACTORLAB_ERROR_STATE_F32_H
#define FACTORLAB_ERROR_STATE_F32_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Times, angles and noises; none depends on the rate of the samples. */
struct error_state_f32_settings {
    float block;               /* s between corrections */
    float gap;                 /* s between samples above which the rotation in between is unknown */
    float motion_bandwidth;    /* 1/s, slower motion than this is bounded */
    float motion_spread;       /* 1, noise assumed over noise seen */
    float motion_floor;        /* m^2/s^3, least level of that noise */
    float motion_time;         /* s over which its level is followed */
    float start_motion;        /* m^2/s^3, its level at the start */
    float gravity;             /* m/s^2 */
    float rest_rate;           /* rad/s, a steady rate above this is no rest */
    float rest_time;           /* s that rest must last */
    float rest_filter;         /* s, time constant of the low-pass */
    float field_doubt;         /* 1, factor on the square of an error of strength and dip in the noise */
    float bias_memory;         /* s over which an unknown bias turns the heading the same way */
    float iron_doubt;          /* 1/s, by which the square of a disturbance makes the hard iron unsure */
    float delay;               /* s by which the field lags the gyro, at the start */
    float latency;             /* s by which the gyro's readings lag their stamps */
    float gyro_noise;          /* rad/s/sqrt(Hz) */
    float tilt_scale;          /* 1, share of the rate by which the gyro may be wrong, on inclination */
    float heading_scale;       /* 1, the same on heading */
    float bias_walk;           /* rad/s/sqrt(s) */
    float bias_sigma;          /* rad/s, at the start */
    float velocity_sigma;      /* m/s, at the start and after a gap */
    float position_sigma;      /* m, likewise */
    float rest_rate_change;    /* rad/s from the low-passed rate at which rest ends */
    float rest_force_change;   /* m/s^2, the same of the force */
    float rest_noise;          /* rad/s/sqrt(Hz) of the gyro's mean at rest */
    float field_noise;         /* sqrt(s) times the length of the field */
    float field_gate;          /* 1, error of strength and dip from which on the field is disturbed */
    float iron_sigma;          /* 1, share of the field: hard iron left by the calibration */
    float iron_walk;           /* 1/sqrt(s), its walk */
    float reference_sigma;     /* 1, of the reference field at the start */
    float reference_walk;      /* 1/sqrt(s) */
    float delay_sigma;         /* s */
    float latency_sigma;       /* s */
    float tilt_floor;          /* rad in the covariance that no filter averages away */
    float heading_floor;       /* 1, the same for the heading, as a share of the field */
    float start_tilt_sigma;    /* rad */
    float start_heading_sigma; /* rad */
    float start_known;         /* rad; until the inclination is known to this the heading begins anew */
};

/* The settings as the step uses them, in the same order: factors, inverses; from gyro_noise on squares. */
struct error_state_f32_derived {
    float block;             /* s, less a rounding */
    float gap;               /* s */
    float damping;           /* 1/s, 2 a */
    float motion_spread;     /* 1 */
    float motion_floor;      /* m^2/s^3 */
    float motion_share;      /* 1/s, half of the rate at which the level is followed */
    float level_prior;       /* m^2/s^3 */
    float gravity;           /* m/s^2 */
    float rest_rate;         /* rad/s */
    float rest_time;         /* s */
    float rest_share;        /* 1/s, inverse of rest_filter */
    float field_doubt;       /* 1 */
    float bias_memory;       /* s, twice */
    float iron_doubt;        /* 1/s */
    float delay;             /* s */
    float latency;           /* s */
    float gyro_noise;        /* rad^2/s */
    float tilt_scale;        /* s, times the square of the rate: rad^2/s; keeps its sign for 0.5 s */
    float heading_scale;     /* s, likewise */
    float bias_walk;         /* rad^2/s^3 */
    float bias_prior;        /* rad^2/s^2 */
    float velocity_prior;    /* m^2/s^2 */
    float position_prior;    /* m^2 */
    float rest_rate_change;  /* rad^2/s^2 */
    float rest_force_change; /* m^2/s^4 */
    float rest_noise;        /* rad^2/s */
    float field_noise;       /* s */
    float field_gate;        /* 1 */
    float iron_prior;        /* 1 */
    float iron_walk;         /* 1/s */
    float reference_prior;   /* 1 */
    float reference_walk;    /* 1/s */
    float delay_prior;       /* s^2 */
    float latency_prior;     /* s^2 */
    float tilt_floor;        /* rad^2 */
    float heading_floor;     /* 1 */
    float tilt_prior;        /* rad^2 */
    float heading_prior;     /* rad^2 */
    float tilt_known;        /* rad^2 */
    float stiffness;         /* 1/s^2, a^2 */
};

/* What a block gathers, floats only; "turned" is in the frame of the gyro, whose z is up. */
struct error_state_f32_sums {
    float force[3];     /* m/s^2, turned */
    float field[3];     /* the magnetometer's unit, turned */
    float turned[9];    /* 1, rotation matrices, row by row */
    float rate[3];      /* rad/s, as read */
    float specific[3];  /* m/s^2, as read */
    float rate_squared; /* rad^2/s^2, without bias */
    float elapsed;      /* s */
    float samples;      /* 1 */
    float forces;       /* 1, samples with a usable force */
    float fields;       /* 1, samples with a new field */
};

struct error_state_f32_state {
    float turn[4];                     /* 1, w x y z: body to the frame of the gyro */
    float tilt[10];                    /* rad, rad/s, m/s, m: rotation found in this block (3), gyro bias (3),
                                        * horizontal velocity (2) and position (2) */
    float level;                       /* m^2/s^3, of the linear acceleration */
    float last_rate[3];                /* rad/s, the reading before */
    float last_field[3];               /* the magnetometer's unit, the reading before */
    float pending;                     /* s over which no gyro was read */
    float latency;                     /* s, of the settings: the attitude is told for this much later */
    float begin[4];                    /* 1, `turn` at the beginning of the block */
    struct error_state_f32_sums sums;  /* of the block */
    float still;                       /* s for which nothing moved, up to rest_time */
    float slow_rate[3];                /* rad/s, low-passed */
    float slow_force[3];               /* m/s^2, low-passed, body */
    float mean_force[3];               /* m/s^2, low-passed, frame of the gyro */
    float age;                         /* s since the start or the last gap, up to 1 */
    float half[2];                     /* 1, cosine and sine of half of the heading of the gyro's frame */
    float heading[7];                  /* rad, 1, 1, s: heading found in this block, reference field (north,
                                        * up) and hard iron (3, body) in lengths of the first field, delay */
    float per_length;                  /* 1 over the magnetometer's unit: inverse length of the first field */
    float unseen;                      /* s since the last correction by the field, up to 0.5 */
    float tilt_cov[55];                /* products of units of `tilt`: lower triangle, row by row */
    float heading_cov[28];             /* products of units of `heading`: the same */
    uint8_t started;                   /* 1 once a force has levelled it */
    uint8_t resting;                   /* 1: nothing moves */
    uint8_t watching;                  /* 1 once the low-passed values are there */
    uint8_t heading_known;             /* 1 once a field has been seen */
    uint8_t disturbed;                 /* 1: strength or dip of the last field were wrong */
    uint8_t closing;                   /* 1: rest and field of a block are still to correct */
    uint8_t unread;                    /* 1: the gyro of the last sample was not usable */
};

/* Settings of sequential.attitude.ErrorStateAttitude(). */
void error_state_f32_defaults(struct error_state_f32_settings *settings);

void error_state_f32_derive(const struct error_state_f32_settings *settings,
                            struct error_state_f32_derived *derived);

/* Level by the accelerometer, heading 0.  Step then takes the same sample with dt = 0. */
void error_state_f32_start(struct error_state_f32_state *state, const struct error_state_f32_derived *derived,
                           const struct imu_f32 *first);

/* One sample, dt seconds after the one before. */
void error_state_f32_step(struct error_state_f32_state *state, const struct error_state_f32_derived *derived,
                          const struct imu_f32 *sample, float dt);

/* With magnetometer, and without (the heading counts from an arbitrary direction); w is not negative. */
void error_state_f32_attitude(const struct error_state_f32_state *state, float world_q_body[4]);
void error_state_f32_heading_free(const struct error_state_f32_state *state, float frame_q_body[4]);

/* Covariances (3, 3), row by row, rad^2, of the rotation error in the body frame, of both attitudes. */
void error_state_f32_covariance(const struct error_state_f32_state *state,
                                const struct error_state_f32_derived *derived, float cov[9]);
void error_state_f32_covariance_6d(const struct error_state_f32_state *state,
                                   const struct error_state_f32_derived *derived, float cov[9]);

/* Gyro bias, rad/s, and its covariance (3, 3), rad^2/s^2. */
void error_state_f32_bias(const struct error_state_f32_state *state, float bias[3]);
void error_state_f32_bias_covariance(const struct error_state_f32_state *state, float cov[9]);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_ERROR_STATE_F32_H */
