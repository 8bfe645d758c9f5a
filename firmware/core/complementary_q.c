/* The step of complementary_q.h: the gyro's turn, the tilt by gravity, the heading by the field. */
#include "complementary_q.h"

#include "divide_q.h"
#include "fixed_q.h"
#include "trig_q.h"

#define ONE INT32_C(0x40000000)         /* Q30 */
#define TURN_LIMIT INT32_C(0x0E666666)  /* 0.45 rad, Q29: half of what an axis turns in one period */

/* a (x) b, Q30; `out` may be one of them. */
static void multiply(const int32_t a[4], const int32_t b[4], int32_t out[4])
{
    int32_t p[4]; /* Q28 */

    p[0] = minus_q(mul32_q(a[0], b[0]),
                   plus_q(plus_q(mul32_q(a[1], b[1]), mul32_q(a[2], b[2])), mul32_q(a[3], b[3])));
    p[1] = plus_q(plus_q(mul32_q(a[0], b[1]), mul32_q(a[1], b[0])),
                  minus_q(mul32_q(a[2], b[3]), mul32_q(a[3], b[2])));
    p[2] = plus_q(plus_q(mul32_q(a[0], b[2]), mul32_q(a[2], b[0])),
                  minus_q(mul32_q(a[3], b[1]), mul32_q(a[1], b[3])));
    p[3] = plus_q(plus_q(mul32_q(a[0], b[3]), mul32_q(a[3], b[0])),
                  minus_q(mul32_q(a[1], b[2]), mul32_q(a[2], b[1])));
    for (uint8_t i = 0; i < 4; i++) {
        out[i] = 4 * clamp_q(p[i], 0x1FFFFFFF);
    }
}

/* One step of Newton's towards unit length. */
static void normalise(int32_t q[4])
{
    uint32_t squared = 0; /* Q28 */
    int16_t more;         /* (1 - |q|^2) / 2, Q16 */

    for (uint8_t i = 0; i < 4; i++) {
        squared += (uint32_t)mul32_q(q[i], q[i]);
    }
    more = (int16_t)((clamp_q((int32_t)(0x10000000U - squared), 0x0FFFEFFF) + 0x1000) >> 13);
    for (uint8_t i = 0; i < 4; i++) {
        q[i] = add_q(q[i], mul32x16_q(q[i], more));
    }
}

/* a b, Q32. */
static uint32_t part(uint32_t a, uint32_t b)
{
    return 4U * (uint32_t)mul32_q((int32_t)(a >> 1), (int32_t)(b >> 1));
}

/* 1 - (1 - share)^n, Q32. */
static uint32_t share_of(uint32_t share, uint16_t n)
{
    uint32_t left = 0xFFFFFFFFU;
    uint32_t factor = 0U - share;

    if (n == 1U) {
        return share;
    }
    while (n > 0U) {
        if ((n & 1U) != 0U) {
            left = part(left, factor);
        }
        factor = part(factor, factor);
        n >>= 1;
    }
    return 0U - left;
}

/* n periods of the gyro, each a turn exp(gyro dt). */
static void turn(int32_t q[4], const int32_t gyro[3], int32_t half_period, uint8_t n)
{
    int32_t by[4];
    uint32_t squared = 0; /* of the half angle, Q28 */
    uint16_t shortage;

    for (uint8_t i = 0; i < 3; i++) {
        by[i + 1] = 2 * clamp_q(mul32_q(gyro[i], half_period), TURN_LIMIT);
        squared += (uint32_t)mul32_q(by[i + 1], by[i + 1]);
    }
    by[0] = cosine_q(squared << 4, &shortage);
    for (uint8_t i = 1; i < 4; i++) {
        by[i] = shortened_q(by[i], shortage);
    }
    while (n > 0U) {
        if ((n & 1U) != 0U) {
            multiply(q, by, q);
        }
        n >>= 1;
        if (n > 0U) {
            multiply(by, by, by);
            normalise(by);
        }
    }
}

/* The vertical in the body frame: third row of the rotation matrix, Q28. */
static void vertical(const int32_t q[4], int32_t v[3])
{
    v[0] = 2 * clamp_q(minus_q(mul32_q(q[1], q[3]), mul32_q(q[0], q[2])), ONE / 2);
    v[1] = 2 * clamp_q(plus_q(mul32_q(q[0], q[1]), mul32_q(q[2], q[3])), ONE / 2);
    v[2] = minus_q(plus_q(mul32_q(q[0], q[0]), mul32_q(q[3], q[3])),
                   plus_q(mul32_q(q[1], q[1]), mul32_q(q[2], q[2])));
}

/* x in 16 bits, x 2^exponent; the length of that. */
static uint16_t length_of(const int32_t x[3], int16_t coarse[3], int8_t *exponent)
{
    uint32_t largest = (uint32_t)(abs_q(x[0]) | abs_q(x[1]) | abs_q(x[2]));
    int32_t y[3] = {x[0], x[1], x[2]};
    uint32_t squared = 0;
    uint16_t root;

    *exponent = 0;
    while (largest >= 0x8000U) {
        largest >>= 1;
        (*exponent)--;
        for (uint8_t i = 0; i < 3; i++) {
            y[i] >>= 1;
        }
    }
    while (largest < 0x4000U) {
        largest <<= 1;
        (*exponent)++;
        for (uint8_t i = 0; i < 3; i++) {
            y[i] *= 2;
        }
    }
    for (uint8_t i = 0; i < 3; i++) {
        coarse[i] = (int16_t)y[i];
        squared += (uint32_t)mul16_q(coarse[i], coarse[i]);
    }
    root = sqrt_q(squared);
    return (uint16_t)(((uint32_t)root + divide_q(squared, root) + 1U) >> 1); /* Newton's step */
}

/* Closes a share, Q32, of the angle between the vertical and the specific force. */
static void lean(int32_t q[4], const int16_t a[3], uint32_t share)
{
    int32_t v[3];
    int32_t c[3]; /* a x v, m/s^2, Q20 */
    int32_t by[4];
    int32_t sine;
    int32_t along;
    int16_t coarse[3];
    int8_t exponent;

    vertical(q, v);
    c[0] = minus_q(mul32x16_q(v[2], a[1]), mul32x16_q(v[1], a[2]));
    c[1] = minus_q(mul32x16_q(v[0], a[2]), mul32x16_q(v[2], a[0]));
    c[2] = minus_q(mul32x16_q(v[1], a[0]), mul32x16_q(v[0], a[1]));
    along = plus_q(plus_q(mul32x16_q(v[0], a[0]), mul32x16_q(v[1], a[1])), mul32x16_q(v[2], a[2]));
    if ((c[0] | c[1] | c[2]) == 0) {
        return;
    }
    const uint16_t length = length_of(c, coarse, &exponent);
    const uint32_t across = exponent < 0 ? (uint32_t)length << -exponent : (uint32_t)length >> exponent;
    const uint32_t angle = atan2_q32((int32_t)across, along); /* in [0, 180] deg */

    sincos_q(2U * (uint32_t)mul32_q((int32_t)(angle >> 1), (int32_t)(share >> 1)), &sine, &by[0]);
    sine = mul32u16_q(sine, divide_q((uint32_t)ONE, length));
    for (uint8_t i = 0; i < 3; i++) {
        by[i + 1] = 4 * mul32x16_q(sine, coarse[i]);
    }
    multiply(q, by, q);
}

/* Closes a share of the angle between north and the level part of the field; 0 where that tells no north. */
static uint8_t head(int32_t q[4], const int16_t m[3], uint32_t share, uint8_t known)
{
    const int32_t turning = minus_q(mul32_q(q[0], q[0]), mul32_q(q[3], q[3])); /* Q28, as the rest */
    const int32_t lying = minus_q(mul32_q(q[1], q[1]), mul32_q(q[2], q[2]));
    const int32_t xy = mul32_q(q[1], q[2]);
    const int32_t wz = mul32_q(q[0], q[3]);
    const int32_t xz_wy = plus_q(mul32_q(q[1], q[3]), mul32_q(q[0], q[2]));
    const int32_t yz_wx = minus_q(mul32_q(q[2], q[3]), mul32_q(q[0], q[1]));
    const int32_t east = plus_q(plus_q(mul32x16_q(plus_q(turning, lying), m[0]),
                                       2 * mul32x16_q(clamp_q(minus_q(xy, wz), ONE / 2), m[1])),
                                2 * mul32x16_q(clamp_q(xz_wy, ONE / 2), m[2])); /* uT, Q20 */
    const int32_t north = plus_q(plus_q(mul32x16_q(minus_q(turning, lying), m[1]),
                                        2 * mul32x16_q(clamp_q(plus_q(xy, wz), ONE / 2), m[0])),
                                 2 * mul32x16_q(clamp_q(yz_wx, ONE / 2), m[2]));
    const uint32_t squared = (uint32_t)mul16_q(m[0], m[0]) + (uint32_t)mul16_q(m[1], m[1]) +
                             (uint32_t)mul16_q(m[2], m[2]); /* uT^2, Q16 */
    int32_t by[4] = {0, 0, 0, 0};
    uint32_t level;
    const int32_t angle = (int32_t)polar_q32(east, north, &level);

    level >>= 12; /* uT, Q8 */
    if (level < 0x10000U && level * level <= squared >> 20) {
        return 0;
    }
    sincos_q((uint32_t)(known != 0U ? mul32_q(angle, (int32_t)(share >> 1)) : angle >> 1), &by[3], &by[0]);
    multiply(by, q, q);
    return 1;
}

void complementary_q_step(struct complementary_q_state *s, const struct complementary_q_derived *d,
                          const struct imu_q *sample, uint8_t periods)
{
    s->status = 0;
    if (periods > d->pause_periods) {
        periods = 0;
    }
    turn(s->q, sample->gyro, d->half_period, periods);
    if ((sample->accel[0] | sample->accel[1] | sample->accel[2]) == 0) {
        s->status = COMPLEMENTARY_Q_ACCEL_REJECTED;
    } else if (periods > 0U) {
        lean(s->q, sample->accel, share_of(d->share, periods));
    }
    s->since_field = (uint16_t)(s->since_field > UINT16_MAX - periods ? UINT16_MAX : s->since_field + periods);
    if ((sample->mag[0] | sample->mag[1] | sample->mag[2]) != 0 &&
        head(s->q, sample->mag, share_of(d->heading_share, s->since_field), s->heading_known) != 0U) {
        s->since_field = 0;
        s->heading_known = 1;
    }
    normalise(s->q);
}
