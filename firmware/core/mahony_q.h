/* Mahony's attitude filter without magnetometer, in fixed point.
 *
 * Computes, with v the vertical in the body frame by the estimate, each period of 1 / rate_hz:
 *     e = a/|a| x v, shortened to error_limit + |mean of e in the world over lasting_time|
 *     at rest   b <- b + (low-passed gyro - b) / (1 + rest_constant rate_hz)
 *     else      b <- b - k_I e dt                         (not during the quick start)
 *     |b_i| <= bias_limit
 *     q <- q (x) exp((gyro - b + k_P e) dt)               third order, as q (x) (1, h (1 + |h|^2 / 3))
 * It is sequential.attitude.Mahony (the double version, same settings and defaults) with numbers of limited
 * length; mahony_q9.h adds the magnetometer.
 *
 * Source: Mahony, Hamel, Pflimlin 2008, Nonlinear complementary filters on the special orthogonal group, eq.
 * 32 and 48; limits, rest and quick start are own, see sequential/attitude/mahony.py.
 *
 * Arithmetic.  The quaternion is Q30; a turn is half an angle, 16 bits in Q16, and what is left of it below
 * is kept for the next sample, so that its rounding does not add up.  The vertical is made of the upper 16
 * bits of the quaternion (error 0.004 deg at most, and bounded).  The length is held by one step of Newton's
 * a sample.
 *
 * Cost: an ATmega328P takes 3 986 cycles at most on eleven recordings, 3 860 on average, 4 100 for the worst
 * samples that we could make (assembler, mahony_q_avr.c); 4.0 kB of flash with the start and what it needs of
 * libgcc, 97 bytes of stack.  A Cortex-M4 takes 1 050 instructions.  Error to the double version: 0.012 deg
 * RMS, 0.032 deg at most in eleven recordings of two to three minutes.
 *
 * What it does with bad input.
 * - Accelerometer all zero: no correction, no rest; the gyro goes on.  Free fall, saturation: only the
 *   direction counts, and its effect is limited by error_limit.
 * - Gyro beyond +-gyro_limit (64 rad/s = 3 667 deg/s at 100 Hz and more): taken as that limit.  2 000 deg/s
 *   is inside.  A stuck gyro: the accelerometer holds roll and pitch, the heading drifts with what is stuck;
 *   one that is stuck within bias_limit, at rest, becomes bias.
 * - Dropped samples: `periods` says how many periods this sample stands for (1: none was dropped).  Each is
 *   turned by in turn, at a cost of its own.  Over more than a second nothing is integrated, and the quick
 *   start begins anew.  0: the first sample, nothing moves.
 * - A wrong rate scales the angles between corrections: nothing here can see it.
 * - Any sample and number of periods, and any bits in the state: no undefined behaviour.  A length from 0.75
 *   to 1.25 comes back to 1 in four updates.
 */
#ifndef FACTORLAB_MAHONY_Q_H
#define FACTORLAB_MAHONY_Q_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As sequential.attitude.Mahony has them; ranges are those at 100 Hz. */
struct mahony_q_settings {
    float gain;           /* k_P, 1/s; 0.0008 ... 15 */
    float integral_gain;  /* k_I, 1/s^2; 0 ... 0.09 */
    float bias_limit;     /* rad/s; at most 0.24 */
    float error_limit;    /* sine of an angle; 2 and more: none */
    float lasting_time;   /* s; at least 2.6 */
    float start_gain;     /* k_P at the start, 1/s; as gain */
    float start_time;     /* s */
    float rest_gyro;      /* rad/s */
    float rest_accel;     /* m/s^2 */
    float rest_time;      /* s; 600 and more: never at rest */
    float rest_constant;  /* s */
};

/* What one sample counts for. */
struct mahony_q_weights {
    uint16_t low;      /* in the low-passes, Q16 */
    uint16_t rest;     /* in the bias at rest, Q16 */
    uint16_t lasting;  /* in the lasting error, Q24 */
    uint16_t integral; /* k_I times the time it stands for, s^-1, Q26 */
    uint8_t periods;   /* that it stands for */
};

/* What the settings are at one rate. */
struct mahony_q_derived {
    uint32_t half_period;            /* s, Q31 */
    int32_t bias_limit;              /* rad/s, Q32 */
    int32_t rest_gyro;               /* rad/s, Q16 */
    int32_t rest_accel;              /* m/s^2, Q8 */
    struct mahony_q_weights weights; /* of a sample that stands for one period */
    uint16_t gain;                   /* k_P times half a period, Q18 */
    uint16_t boost;                  /* what is added to `gain` for each period left of the start, Q26 */
    uint16_t error_limit;            /* sine, Q14 */
    uint16_t low_periods;            /* time constant of the low-passes, periods */
    uint16_t constant_periods;       /* time constant of the bias at rest, periods */
    uint16_t start_periods;          /* of quick start, periods */
    uint16_t rest_periods;           /* still for so many: at rest, periods */
    uint16_t pause_periods;          /* nothing is integrated over more, periods */
    int8_t gyro_limit;               /* rad/s */
};

struct mahony_q_state {
    int32_t q[4];            /* world_q_body: w x y z, Q30 */
    int32_t bias[3];         /* of the gyro, rad/s, Q32 */
    int32_t gyro_low[3];     /* low-passed, rad/s, Q24 */
    uint8_t accel_low[3][3]; /* low-passed, m/s^2, Q16 in 24 bits, lowest byte first */
    uint8_t lasting[2][3];   /* lasting error, east and north, sine, Q22 in 24 bits, lowest byte first */
    uint8_t turn_left[3];    /* what the turns left over, half angle, rad, Q24 */
    uint8_t status;          /* MAHONY_Q_REST ... */
    uint16_t start_left;     /* of quick start, periods */
    uint16_t still;          /* for so long, periods */
};

/* bits of the status: those of frame.h */
#define MAHONY_Q_REST 0x01U           /* the bias is being learnt */
#define MAHONY_Q_ACCEL_REJECTED 0x02U /* the accelerometer's error was shortened, or there was none */

/* Those of sequential.attitude.Mahony(). */
void mahony_q_defaults(struct mahony_q_settings *settings);

/* For 72 to 1 000 samples a second; settings out of range become the nearest that fit.  In single
 * precision: an AVR takes mahony_q_100hz.h instead. */
void mahony_q_derive(const struct mahony_q_settings *settings, uint16_t rate_hz,
                     struct mahony_q_derived *derived);

/* Level by the accelerometer, yaw 0, no bias. */
void mahony_q_start(struct mahony_q_state *state, const struct mahony_q_derived *derived,
                    const struct imu_q *first);

/* `periods` of 1 / rate_hz since the last sample: 1, or n after n - 1 that dropped out, or 0 for the
 * first; 255 also stands for more. */
void mahony_q_step(struct mahony_q_state *state, const struct mahony_q_derived *derived,
                   const struct imu_q *sample, uint8_t periods);

/* world_q_body, Q30, of length 1 within 1e-4. */
void mahony_q_attitude(const struct mahony_q_state *state, int32_t world_q_body[4]);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_MAHONY_Q_H */
