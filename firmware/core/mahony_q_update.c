/* The arithmetic of mahony_q.h: rest, error of the accelerometer, bias, turn.  On an AVR: mahony_q_avr.c. */
#include <stddef.h>

#include "fixed_q.h"
#include "mahony_q_parts.h"

static int32_t load24(const uint8_t bytes[3])
{
    return (int32_t)((uint32_t)bytes[0] << 8 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 24) >> 8;
}

static void store24(int32_t value, uint8_t bytes[3])
{
    bytes[0] = (uint8_t)value;
    bytes[1] = (uint8_t)((uint32_t)value >> 8);
    bytes[2] = (uint8_t)((uint32_t)value >> 16);
}

/* The gyro within its limit. */
static int32_t within_range(int32_t gyro, int8_t limit)
{
    const int8_t whole = (int8_t)(gyro >> 24);
    if (whole >= limit) {
        return (int32_t)(((uint32_t)limit << 24) - 1U);
    }
    return whole < -limit ? -(int32_t)limit * 0x1000000L : gyro;
}

/* Low-passes both sensors and counts the periods of stillness. */
static void rest(struct mahony_q_state *s, const struct mahony_q_derived *d, const struct imu_q *sample,
                 const struct mahony_q_weights *weights)
{
    uint8_t still = 1;
    for (uint8_t i = 0; i < 3; i++) {
        const int32_t apart = minus_q(within_range(sample->gyro[i], d->gyro_limit), s->gyro_low[i]);
        const int32_t drawn = mul32u16_q(apart, weights->low);
        s->gyro_low[i] = plus_q(s->gyro_low[i], drawn);
        still &= within_q(minus_q(apart, drawn) >> 8, d->rest_gyro);
        still &= within_q(s->gyro_low[i] >> 8, d->bias_limit >> 16);
    }
    for (uint8_t i = 0; i < 3; i++) {
        int32_t low = load24(s->accel_low[i]);
        const int16_t apart = narrow_q((int32_t)sample->accel[i] - (low >> 8)); /* Q8 */
        low += plus_q(mul16u_q(apart, weights->low), 0x80) >> 8;
        store24(low, s->accel_low[i]);
        still &= within_q((int32_t)sample->accel[i] - (low >> 8), d->rest_accel);
    }
    if (!still) {
        s->still = 0;
    } else {
        const uint16_t longer = (uint16_t)(s->still + weights->periods);
        s->still = longer < weights->periods ? UINT16_MAX : longer;
    }
}

/* Draws the lasting error to `error`, Q14. */
static void remember(struct mahony_q_state *s, const int16_t error[2], uint16_t weight)
{
    for (uint8_t i = 0; i < 2; i++) {
        const int32_t mean = load24(s->lasting[i]);
        const int16_t apart = (int16_t)((uint16_t)error[i] - (uint16_t)(mean >> 8));
        store24(mean + high16_q(mul16u_q(apart, weight)), s->lasting[i]);
    }
}

static uint32_t square2(int16_t a, int16_t b)
{
     return (uint32_t)mul16_q(a, a) + (uint32_t)mul16_q(b, b); }

/* Shortens the error to its limit; 1 if it did. */
static uint8_t shorten(const struct mahony_q_state *s, uint16_t error_limit, int16_t error[2])
{
    const int16_t east = (int16_t)(load24(s->lasting[0]) >> 8);
    const int16_t north = (int16_t)(load24(s->lasting[1]) >> 8);
    uint32_t squared = square2(error[0], error[1]);
    uint16_t limit = (uint16_t)(error_limit + length_q(east, north));
    if (squared <= (uint32_t)limit * limit) {
        return 0;
    }
    while (squared < 0x40000000UL) {
        squared <<= 2;
        limit = (uint16_t)(limit << 1);
    }
    const uint16_t shorter = (uint16_t)(((uint32_t)limit * inverse_sqrt_q(squared)) >> 15); /* Q16 */
    error[0] = high16_q(mul16u_q(error[0], shorter));
    error[1] = high16_q(mul16u_q(error[1], shorter));
    return 1;
}

/* The vertical in the body's axes, Q14. */
static void upwards(const struct rows_q *rows, int16_t up[3])
{
    for (uint8_t i = 0; i < 3; i++) {
        const uint8_t j = (uint8_t)(i == 2U ? 0U : i + 1U);
        const uint8_t k = (uint8_t)(i == 0U ? 2U : i - 1U);
        up[i] = high16_q(up_q(
            minus_q(mul16_q(rows->east[j], rows->north[k]), mul16_q(rows->east[k], rows->north[j])), 2));
    }
}

/* A number times a component of the vertical, Q14. */
static int32_t along(int32_t number, int16_t component)
{
    return mul32x16_q(up_q(number, 2), component);
}

/* Draws the bias to the low-passed gyro, at rest, or against the error, after the start. */
static void learn(struct mahony_q_state *s, const struct mahony_q_derived *d,
                  const struct mahony_q_weights *weights, const int16_t e[3], const int32_t more[3])
{
    for (uint8_t i = 0; i < 3; i++) {
        if ((s->status & MAHONY_Q_REST) != 0U) { /* between two that are within the limit */
            const int32_t apart = minus_q(up_q(s->gyro_low[i], 8), s->bias[i]);
            s->bias[i] = plus_q(s->bias[i], mul32u16_q(apart, weights->rest));
        } else if (s->start_left == 0U) {
            const int32_t change = plus_q(mul16u_q(e[i], weights->integral), 0x80) >> 8;
            s->bias[i] = clamp_q(minus_q(minus_q(s->bias[i], change), more[i]), d->bias_limit);
        }
    }
}

void mahony_q_update_heading(struct mahony_q_state *s, const struct mahony_q_derived *d,
                             const struct imu_q *sample, const struct mahony_q_weights *weights,
                             uint16_t gain, const struct mahony_q_heading *heading)
{
    struct rows_q rows;
    int32_t half[3] = {0, 0, 0};
    int32_t bias[3] = {0, 0, 0};
    int16_t level[2];
    int16_t e[3] = {0, 0, 0};

    rows_q(s->q, &rows);
    if (heading != NULL) {
        int16_t up[3];
        upwards(&rows, up);
        for (uint8_t i = 0; i < 3; i++) {
            half[i] = along(heading->half, up[i]);
            bias[i] = along(heading->bias, up[i]);
        }
    }
    s->status = 0;
    if (level_q(&rows, sample->accel, level)) {
        rest(s, d, sample, weights);
        int16_t error[2]; /* a x up */
        error[0] = level[1];
        error[1] = (int16_t)(0U - (uint16_t)level[0]);
        remember(s, error, weights->lasting);
        if (s->start_left == 0U && shorten(s, d->error_limit, error)) {
            s->status = MAHONY_Q_ACCEL_REJECTED;
        }
        back_q(&rows, error, e);
    } else {
        s->still = 0;
        s->status = MAHONY_Q_ACCEL_REJECTED;
    }
    if (s->still >= d->rest_periods) {
        s->status |= MAHONY_Q_REST;
    }
    learn(s, d, weights, e, bias);
    for (uint8_t i = 0; i < 3; i++) {
        const int32_t gyro = within_range(sample->gyro[i], d->gyro_limit);
        const int32_t rate = up_q(minus_q(gyro, s->bias[i] >> 8), 1); /* Q25 */
        const int32_t fine = mul16u_q((int16_t)(rate >> 16), (uint8_t)d->half_period) >> 8;
        const int32_t turned = plus_q(mul32u16_q(rate, (uint16_t)(d->half_period >> 8)), fine); /* Q32 */
        half[i] = plus_q(half[i], plus_q(turned, mul16u_q(e[i], gain)));
    }
    for (uint8_t left = weights->periods; left > 0U; left--) {
        turn_q(s->q, half, s->turn_left, rows.short_of);
        rows.short_of = 0;
    }
}

#ifndef __AVR__
void mahony_q_update(struct mahony_q_state *s, const struct mahony_q_derived *d, const struct imu_q *sample,
                     const struct mahony_q_weights *weights, uint16_t gain)
{
    mahony_q_update_heading(s, d, sample, weights, gain, NULL);
}
#endif
