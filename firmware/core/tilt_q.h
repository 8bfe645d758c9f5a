/* The tilt Kalman filter in fixed point: roll, pitch and yaw, each an angle with the bias of its rate.
 *
 * Each channel predicts with the rate u of its angle and corrects with the angle z that gravity, or the field
 * levelled by roll and pitch, gives:
 *     angle <- angle + (u - b) dt,   F = [1 -dt; 0 1],   Q of white noise and bias walk,   z = angle + noise
 * It is sequential.attitude.TiltKalman (the double version, same settings and defaults) with numbers of limited
 * length.
 *
 * Source: the two-state filter of textbooks (Kalman 1960), see sequential/attitude/tilt_kernel.py.
 *
 * Arithmetic.  Angles are binary, 2^32 = 360 deg, and wrap by themselves.  A bias is that of one period, and the
 * covariance is that of angle and bias a period, divided by R: then a period is predicted by sums alone, and a
 * correction, with g = 1 / (1 + p), is p <- 1 - g, c <- c g, b <- b - c (c g), the gains are p and c, and the one
 * division of a channel gives 32 bits of g.  How small b and c are, the settings tell: `finer` places their points.
 * Error against double: tests/firmware/test_tilt_q.py.  Cost: firmware/budget.csv.
 *
 * What it does with bad input.
 * - Accelerometer all zero: predicted, not corrected; the variances grow until they saturate at 3 R, and
 *   of the bias at 2^-8 R / period^2 or less.  Saturated: a wrong angle; beyond the gate it is refused.
 * - Gyro stuck: its rate is a bias, drawn to at the pace that bias_walk says, and to bias_limit at most.
 * - 2 000 deg/s: Euler's step on the angles, as in the reference; rates of angles saturate at 512 rad/s.
 * - Dropped samples: `periods` says how many periods this sample stands for; each is predicted in turn.  Over more
 *   than a second (or 254 periods) nothing is integrated, and the next good angle is taken as it is, nearly.
 *   0: the first sample, nothing moves.
 * - A wrong rate scales the angles between corrections: nothing here can see it.
 * - Magnetometer all zero: yaw is predicted, not corrected.  The first field sets yaw and forgets its covariance with
 *   the bias, which would otherwise have grown since the start and take the first headings for a bias.
 * - Pitch of +-90 deg: rates of roll and yaw are divided by 0.05 at least.
 * - Any state, sample and number of periods: no undefined behaviour, no overflow that matters.
 */
#ifndef FACTORLAB_TILT_Q_H
#define FACTORLAB_TILT_Q_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As sequential.attitude.TiltKalman has them. */
struct tilt_q_settings {
    float gyro_density;  /* rad/s/sqrt(Hz), white noise of the rates */
    float bias_walk;     /* rad/s^2/sqrt(Hz), random walk of the biases */
    float tilt_sigma;    /* rad, of roll and pitch by the accelerometer */
    float heading_sigma; /* rad, of yaw by the magnetometer */
    float nis_gate;      /* 1, largest squared innovation over its variance; infinity: no gate */
    float bias_sigma;    /* rad/s, of the biases before the first sample; below 0.034 rate tilt_sigma */
    float bias_limit;    /* rad/s, at most 1.2 at 100 Hz; the double version has none */
};

/* Of one kind of measurement, everything divided by its variance R: an angle by gravity, or one by the field. */
struct tilt_q_noise {
    uint32_t angle;        /* added to p a period, 1, Q30 */
    uint32_t bias;         /* added to b a period, per period^2, Q(54 + finer) */
    uint32_t first_bias;   /* b of an unknown bias, per period^2, Q(38 + finer) */
    uint32_t unknown_gain; /* p / (1 + p) of an unknown angle, 1, Q32 */
    uint32_t gate;         /* on the squared innovation over 1 + p, 2^16 of a turn, squared; all ones: none */
    int32_t both;          /* taken off c a period, per period, Q(38 + finer) */
    uint8_t finer;         /* bits, 0 to 6: as many as leave room for b and c after the start */
};

/* What the settings are at one rate. */
struct tilt_q_derived {
    struct tilt_q_noise noise[2]; /* by gravity, by the field */
    int32_t turn;                 /* 2^-29 turns a period for a rate of 2^-22 rad/s, Q32 */
    int32_t rate;                 /* rad/s, Q24, for 2^-40 turns a period, Q32 */
    int32_t bias_limit;           /* 2^-32 turns a period, Q8 */
    uint8_t pause_periods;        /* nothing is integrated over more, periods */
};

struct tilt_q_channel {
    uint32_t angle;     /* 2^32 = 360 deg */
    int32_t bias;       /* of its rate, 2^-32 turns a period, Q8 */
    uint32_t p;         /* variance of the angle over R, 1, Q30 */
    int32_t c;          /* covariance of angle and bias over R, per period, Q(38 + finer) */
    uint32_t b;         /* variance of the bias over R, per period^2, Q(38 + finer) ... */
    uint16_t b_below;   /* ... and what it has below, Q(54 + finer) */
    uint8_t known;      /* 0: the variance of the angle is that of no knowledge */
};

struct tilt_q_state {
    struct tilt_q_channel channel[3]; /* roll, pitch, yaw */
    uint8_t heading_known;            /* 1: a field has been seen */
    uint8_t status;                   /* TILT_Q_ACCEL_REJECTED ... */
};

/* bits of the status: those of frame.h */
#define TILT_Q_ACCEL_REJECTED 0x02U /* an angle by gravity was beyond the gate, or there was none */
#define TILT_Q_MAG_DISTURBED 0x04U  /* the heading was beyond the gate */

/* Those of sequential.attitude.TiltKalman(), and a bias_limit of 1 rad/s. */
void tilt_q_defaults(struct tilt_q_settings *settings);

/* For 42 to 1 000 samples a second; settings out of range become the nearest that fit.  In single precision: an AVR
 * takes tilt_q_100hz.h instead. */
void tilt_q_derive(const struct tilt_q_settings *settings, uint16_t rate_hz, struct tilt_q_derived *derived);

/* The angles of the accelerometer, yaw 0, no bias.  Step then takes the same sample with 0 periods. */
void tilt_q_start(struct tilt_q_state *state, const struct tilt_q_derived *derived, const struct imu_q *first);

/* `periods` of 1 / rate_hz since the last sample: 1, or n after n - 1 that dropped out, or 0 for the first; 255 also
 * stands for more. */
void tilt_q_step(struct tilt_q_state *state, const struct tilt_q_derived *derived, const struct imu_q *sample,
                 uint8_t periods);

void tilt_q_angles(const struct tilt_q_state *state, int16_t roll_pitch_yaw[3] /* 65536 = 360 deg */);
void tilt_q_attitude(const struct tilt_q_state *state, int32_t world_q_body[4] /* Q30 */);

/* The biases about the body's axes. */
void tilt_q_gyro_bias(const struct tilt_q_state *state, const struct tilt_q_derived *derived,
                      int32_t gyro_bias[3] /* rad/s, Q24 */);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_TILT_Q_H */
