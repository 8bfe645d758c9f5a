/* The step of mahony_q.h: error of the accelerometer, rest, bias, turn. */
#include "mahony_q.h"

#include "fixed_q.h"

#define ONE_Q28 0x10000000L
#define LENGTH_LIMIT 0x1000 /* 1/16, Q16: what one step mends of the length */

/* Products of the quaternion's components, Q28. */
struct products {
    int32_t ww, xx, yy, zz;
    int32_t wx, wy, wz, xy, xz, yz;
};

static void multiply(const int32_t q[4], struct products *of)
{
    const int16_t w = high16_q(q[0]); /* Q14 */
    const int16_t x = high16_q(q[1]);
    const int16_t y = high16_q(q[2]);
    const int16_t z = high16_q(q[3]);
    of->ww = mul16_q(w, w);
    of->xx = mul16_q(x, x);
    of->yy = mul16_q(y, y);
    of->zz = mul16_q(z, z);
    of->wx = mul16_q(w, x);
    of->wy = mul16_q(w, y);
    of->wz = mul16_q(w, z);
    of->xy = mul16_q(x, y);
    of->xz = mul16_q(x, z);
    of->yz = mul16_q(y, z);
}

/* (1 - |q|^2) / 2, Q16. */
static int16_t shortness(const struct products *of)
{
    const int32_t squared = plus_q(plus_q(of->ww, of->xx), plus_q(of->yy, of->zz));
    return (int16_t)clamp_q(high16_q(up_q(clamp_q(minus_q(ONE_Q28, squared), 0x0FFFFFFFL), 3)), LENGTH_LIMIT);
}

/* a / |a|, Q15; 0 where a is 0. */
static uint8_t direction(const int16_t a[3], int16_t u[3])
{
    int16_t scaled[3];
    uint16_t largest = 0;
    uint32_t squared = 0;
    for (uint8_t i = 0; i < 3; i++) {
        scaled[i] = a[i];
        largest |= (uint16_t)(a[i] < 0 ? -(int32_t)a[i] : a[i]);
    }
    if (largest == 0) {
        return 0;
    }
    while (largest < 0x4000U) {
        largest = (uint16_t)(largest << 1);
        for (uint8_t i = 0; i < 3; i++) {
            scaled[i] = (int16_t)(2 * scaled[i]);
        }
    }
    for (uint8_t i = 0; i < 3; i++) {
        squared += (uint32_t)mul16_q(scaled[i], scaled[i]);
    }
    const uint8_t doubled = squared < 0x40000000UL;
    const uint16_t inverse = inverse_sqrt_q(doubled ? squared << 2 : squared);
    for (uint8_t i = 0; i < 3; i++) {
        const int32_t scaled_up = mul16u_q(scaled[i], inverse);
        u[i] = high16_q(doubled ? up_q(scaled_up, 1) : scaled_up);
    }
    return 1;
}

/* u x v for v the vertical, Q14. */
static void error_of(const int16_t u[3], const struct products *of, int16_t e[3])
{
    const int16_t vx = high16_q(up_q(minus_q(of->xz, of->wy), 3)); /* Q14 */
    const int16_t vy = high16_q(up_q(plus_q(of->wx, of->yz), 3));
    const int16_t vz = high16_q(up_q(minus_q(plus_q(of->ww, of->zz), plus_q(of->xx, of->yy)), 2));
    e[0] = high16_q(up_q(minus_q(mul16_q(u[1], vz), mul16_q(u[2], vy)), 1));
    e[1] = high16_q(up_q(minus_q(mul16_q(u[2], vx), mul16_q(u[0], vz)), 1));
    e[2] = high16_q(up_q(minus_q(mul16_q(u[0], vy), mul16_q(u[1], vx)), 1));
}

/* Draws one axis of the lasting error to `now`, Q26. */
static void last(int16_t *lasting, uint8_t *below, int32_t now, uint16_t keep)
{
    const int16_t apart = (int16_t)((uint16_t)high16_q(up_q(now, 4)) - (uint16_t)*lasting);
    int32_t mean = (int32_t)(((uint32_t)(int32_t)*lasting << 8) | *below);
    mean = plus_q(mean, high16_q(mul16u_q(apart, keep)));
    *lasting = (int16_t)(mean >> 8);
    *below = (uint8_t)mean;
}

/* The error in the world's axes, drawn into its mean. */
static void remember(struct mahony_q_state *s, const struct products *of, const int16_t e[3], uint16_t keep)
{
    const int32_t turning = minus_q(of->ww, of->zz); /* rows of the rotation matrix, Q28, then Q12 */
    const int32_t lying = minus_q(of->xx, of->yy);
    const int16_t ee = high16_q(plus_q(turning, lying));
    const int16_t en = high16_q(up_q(minus_q(of->xy, of->wz), 1));
    const int16_t eu = high16_q(up_q(plus_q(of->xz, of->wy), 1));
    const int16_t ne = high16_q(up_q(plus_q(of->xy, of->wz), 1));
    const int16_t nn = high16_q(minus_q(turning, lying));
    const int16_t nu = high16_q(up_q(minus_q(of->yz, of->wx), 1));
    last(&s->lasting[0], &s->lasting_below[0],
         plus_q(plus_q(mul16_q(ee, e[0]), mul16_q(en, e[1])), mul16_q(eu, e[2])), keep);
    last(&s->lasting[1], &s->lasting_below[1],
         plus_q(plus_q(mul16_q(ne, e[0]), mul16_q(nn, e[1])), mul16_q(nu, e[2])), keep);
}

/* Shortens the error to its limit; 1 if it did. */
static uint8_t shorten(const struct mahony_q_state *s, uint16_t error_limit, int16_t e[3])
{
    uint32_t squared = (uint32_t)mul16_q(e[0], e[0]) + (uint32_t)mul16_q(e[1], e[1]) + (uint32_t)mul16_q(e[2], e[2]);
    uint16_t limit = (uint16_t)(error_limit + sqrt_q((uint32_t)mul16_q(s->lasting[0], s->lasting[0]) +
                                                     (uint32_t)mul16_q(s->lasting[1], s->lasting[1])));
    if (squared <= (uint32_t)limit * limit) {
        return 0;
    }
    while (squared < 0x40000000UL) {
        squared <<= 2;
        limit = (uint16_t)(limit << 1);
    }
    const uint16_t shorter = (uint16_t)(((uint32_t)limit * inverse_sqrt_q(squared)) >> 15); /* Q16 */
    for (uint8_t i = 0; i < 3; i++) {
        e[i] = high16_q(mul16u_q(e[i], shorter));
    }
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

/* The upper 24 bits of q times h: Q38. */
static int64_t part(int32_t q, int16_t h)
{
    return (int64_t)(q >> 8) * h;
}

/* Q38 to Q30, rounded. */
static int32_t narrowed(int64_t sum)
{
    return (int32_t)((sum + 0x80) >> 8);
}

/* q (x) (1, h), then times 1 + longer; h half angles, Q16; longer Q16. */
static void turn(int32_t q[4], const int16_t h[3], int16_t longer)
{
    const int32_t w = q[0];
    const int32_t x = q[1];
    const int32_t y = q[2];
    const int32_t z = q[3];
    q[0] = plus_q(w, narrowed(-part(x, h[0]) - part(y, h[1]) - part(z, h[2])));
    q[1] = plus_q(x, narrowed(part(w, h[0]) + part(y, h[2]) - part(z, h[1])));
    q[2] = plus_q(y, narrowed(part(w, h[1]) + part(z, h[0]) - part(x, h[2])));
    q[3] = plus_q(z, narrowed(part(w, h[2]) + part(x, h[1]) - part(y, h[0])));
    for (uint8_t i = 0; i < 4; i++) {
        q[i] = plus_q(q[i], narrowed(part(q[i], longer)));
    }
}

/* One period's turn: the third order, what the last one left, the quaternion. `half` Q32. */
static void turn_by(struct mahony_q_state *s, const int32_t half[3], int16_t longer)
{
    int16_t h[3];
    uint32_t squared = 0; /* Q32 */
    for (uint8_t i = 0; i < 3; i++) {
        h[i] = high16_q(half[i]);
        squared += (uint32_t)mul16_q(h[i], h[i]);
    }
    const uint16_t third = (uint16_t)(((squared >> 16) * 21845U) >> 16); /* |h|^2 / 3, Q16 */
    for (uint8_t i = 0; i < 3; i++) {
        uint32_t turned = (uint32_t)half[i] + (uint32_t)mul16u_q(h[i], third) + 0x80U;
        turned += (uint32_t)s->turn_left[i] << 8;
        h[i] = (int16_t)(turned >> 16);
        s->turn_left[i] = (uint8_t)(turned >> 8);
    }
    turn(s->q, h, (int16_t)(longer - (int16_t)(squared >> 17)));
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
    int32_t gyro[3];
    int32_t half[3];
    int16_t u[3];
    int16_t e[3] = {0, 0, 0};
    struct products of;

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
    multiply(s->q, &of);
    s->status = 0;
    if (direction(sample->accel, u)) {
        const uint32_t keep = (uint32_t)d->lasting_keep * periods;
        rest(s, d, gyro, sample->accel, periods);
        error_of(u, &of, e);
        remember(s, &of, e, keep > UINT16_MAX ? UINT16_MAX : (uint16_t)keep);
        if (s->start_left == 0U && shorten(s, d->error_limit, e)) {
            s->status = MAHONY_Q_ACCEL_REJECTED;
        }
    } else {
        s->still = 0;
        s->status = MAHONY_Q_ACCEL_REJECTED;
    }
    if (s->still > d->rest_periods) {
        s->status |= MAHONY_Q_REST;
    }
    learn(s, d, e, periods);
    const uint16_t gain = (uint16_t)(d->gain + (uint16_t)(((uint32_t)d->boost * s->start_left) >> 8));
    for (uint8_t i = 0; i < 3; i++) {
        const int32_t rate = up_q(minus_q(gyro[i], s->bias[i] >> 8), 1); /* Q25 */
        half[i] = plus_q(mul32u24_q(rate, d->half_period), mul16u_q(e[i], gain));
    }
    int16_t longer = shortness(&of);
    for (; periods > 0U; periods--) {
        turn_by(s, half, longer);
        longer = 0;
    }
}

void mahony_q_attitude(const struct mahony_q_state *s, int32_t world_q_body[4])
{
    for (uint8_t i = 0; i < 4; i++) {
        world_q_body[i] = s->q[i];
    }
}
