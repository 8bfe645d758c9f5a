/* The step of mahony_q.h: error of the accelerometer, rest, bias, turn. */
#include "mahony_q.h"

#include "fixed_q.h"
#include "turning_q.h"

/* Draws the lasting error to `error`, Q14. */
static void remember(struct mahony_q_state *s, const int16_t error[2], uint16_t keep)
{
    for (uint8_t i = 0; i < 2; i++) {
        const int16_t apart = (int16_t)((uint16_t)error[i] - (uint16_t)s->lasting[i]);
        int32_t mean = (int32_t)(((uint32_t)(int32_t)s->lasting[i] << 8) | s->lasting_below[i]); /* Q22 */
        mean += high16_q(mul16u_q(apart, keep));
        s->lasting[i] = (int16_t)(mean >> 8);
        s->lasting_below[i] = (uint8_t)mean;
    }
}

static uint32_t square2(const int16_t v[2])
{
    return (uint32_t)mul16_q(v[0], v[0]) + (uint32_t)mul16_q(v[1], v[1]);
}

/* Shortens the error to its limit; 1 if it did. */
static uint8_t shorten(const struct mahony_q_state *s, uint16_t error_limit, int16_t error[2])
{
    uint32_t squared = square2(error);
    uint16_t limit = (uint16_t)(error_limit + sqrt_q(square2(s->lasting)));
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

/* n / (periods + n), Q16: the weight of a sample that stands for n periods. */
static uint16_t weight(uint16_t periods, uint16_t keep, uint8_t n)
{
    return n == 1U ? keep : (uint16_t)(((uint32_t)n << 16) / ((uint32_t)periods + n));
}

/* Low-passes both sensors and counts the periods of stillness. */
static void rest(struct mahony_q_state *s, const struct mahony_q_derived *d, const int32_t gyro[3],
                 const int16_t accel[3], uint8_t periods)
{
    const uint16_t keep = weight(d->low_periods, d->low_keep, periods);
    uint8_t still = 1;
    for (uint8_t i = 0; i < 3; i++) {
        s->gyro_low[i] = plus_q(s->gyro_low[i], mul32u16_q(minus_q(gyro[i], s->gyro_low[i]), keep));
        still &= within_q(minus_q(gyro[i], s->gyro_low[i]), d->rest_gyro);
        still &= within_q(s->gyro_low[i], d->bias_limit >> 8);
        int32_t low = (int32_t)(((uint32_t)(int32_t)s->accel_low[i] << 8) | s->accel_below[i]); /* Q16 */
        const int32_t now = (int32_t)accel[i] * 256;
        low += mul32u16_q(now - low, keep);
        still &= within_q(now - low, d->rest_accel);
        s->accel_low[i] = (int16_t)(low >> 8);
        s->accel_below[i] = (uint8_t)low;
    }
    if (!still) {
        s->still = 0;
    } else {
        const uint16_t longer = (uint16_t)(s->still + periods);
        s->still = longer < periods ? UINT16_MAX : longer;
    }
}

/* Draws the bias to the low-passed gyro, at rest, or against the error, after the start. */
static void learn(struct mahony_q_state *s, const struct mahony_q_derived *d, const int16_t e[3], uint8_t periods)
{
    const uint8_t resting = (s->status & MAHONY_Q_REST) != 0U;
    const uint16_t keep = weight(d->constant_periods, d->rest_keep, periods);
    for (uint8_t i = 0; i < 3; i++) {
        int32_t bias = s->bias[i];
        if (resting) {
            bias = plus_q(bias, mul32u16_q(minus_q(up_q(s->gyro_low[i], 8), bias), keep));
        } else if (s->start_left == 0U) {
            const int32_t change = (mul16u_q(e[i], d->integral_gain) + 0x80) >> 8;
            bias = minus_q(bias, periods == 1U ? change : (int32_t)((uint32_t)change * periods));
        }
        s->bias[i] = clamp_q(bias, d->bias_limit);
    }
}

/* The gyro within its limit. */
static int32_t within_range(int32_t gyro, int8_t limit)
{
    const int8_t whole = (int8_t)(gyro >> 24);
    if (whole >= limit) {
        return ((int32_t)limit << 24) - 1;
    }
    return whole < -limit ? -(int32_t)limit * 0x1000000L : gyro;
}

void mahony_q_step(struct mahony_q_state *s, const struct mahony_q_derived *d, const struct imu_q *sample,
                   uint8_t periods)
{
    struct rows_q rows;
    int32_t gyro[3];
    int32_t half[3];
    int16_t u[3];
    int16_t error[2];
    int16_t e[3] = {0, 0, 0};

    if (periods > d->pause_periods) {
        s->start_left = d->start_periods;
        s->still = 0;
        periods = 0;
    }
    if (periods == 0U) {
        return;
    }
    s->start_left = s->start_left > periods ? (uint16_t)(s->start_left - periods) : 0U;
    for (uint8_t i = 0; i < 3; i++) {
        gyro[i] = within_range(sample->gyro[i], d->gyro_limit);
    }
    rows_q(s->q, &rows);
    s->status = 0;
    if (direction_q(sample->accel, u)) {
        const uint32_t keep = (uint32_t)d->lasting_keep * periods;
        rest(s, d, gyro, sample->accel, periods);
        along_q(&rows, u, error);
        const int16_t east = error[0];
        error[0] = error[1]; /* a x up */
        error[1] = (int16_t)(0U - (uint16_t)east);
        remember(s, error, keep > UINT16_MAX ? UINT16_MAX : (uint16_t)keep);
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
    learn(s, d, e, periods);
    const uint16_t gain = (uint16_t)(d->gain + (uint16_t)(((uint32_t)d->boost * s->start_left) >> 8));
    for (uint8_t i = 0; i < 3; i++) {
        const int32_t rate = up_q(minus_q(gyro[i], s->bias[i] >> 8), 1); /* Q25 */
        half[i] = plus_q(mul32u24_q(rate, d->half_period), mul16u_q(e[i], gain));
    }
    for (; periods > 0U; periods--) {
        turn_q(s->q, half, s->turn_left, rows.short_of);
        rows.short_of = 0;
    }
}

void mahony_q_attitude(const struct mahony_q_state *s, int32_t world_q_body[4])
{
    for (uint8_t i = 0; i < 4; i++) {
        world_q_body[i] = s->q[i];
    }
}
