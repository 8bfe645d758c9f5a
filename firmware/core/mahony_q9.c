/* The heading of mahony_q9.h. */
#include "mahony_q9.h"

#include "fixed_q.h"
#include "mahony_q_parts.h"

#define STEEP_Q28 268U /* (1e-3)^2: a field closer to the vertical tells no heading */
#define ONE_Q14 0x4000
#define MOST ((int32_t)INT32_MAX)
#define TURNED ((int32_t)0x07FFFFFF) /* 1/32, Q32: half of what one period turns the heading by at most */

/* Horizontal direction of the field, Q14; 0 where it tells none. */
static uint8_t horizontal(const struct rows_q *rows, const int16_t mag[3], int16_t east_north[2])
{
    if (!level_q(rows, mag, east_north)) {
        return 0;
    }
    uint32_t squared =
        (uint32_t)mul16_q(east_north[0], east_north[0]) + (uint32_t)mul16_q(east_north[1], east_north[1]);
    if (squared <= STEEP_Q28) {
        return 0;
    }
    while (squared < 0x10000000UL) {
        squared <<= 2;
        east_north[0] = (int16_t)((uint16_t)east_north[0] << 1);
        east_north[1] = (int16_t)((uint16_t)east_north[1] << 1);
    }
    const uint16_t inverse = inverse_sqrt_q(squared << 2);
    east_north[0] = high16_q(mul16u_q(east_north[0], inverse));
    east_north[1] = high16_q(mul16u_q(east_north[1], inverse));
    return 1;
}

/* q <- (c, 0, 0, s) (x) q, both Q31. */
static void turn_about_vertical(int32_t q[4], int32_t c, int32_t s)
{
    const int32_t w = q[0];
    const int32_t x = q[1];
    const int32_t y = q[2];
    const int32_t z = q[3];
    q[0] = up_q(minus_q(mul32_q(w, c), mul32_q(z, s)), 1);
    q[1] = up_q(minus_q(mul32_q(x, c), mul32_q(y, s)), 1);
    q[2] = up_q(plus_q(mul32_q(y, c), mul32_q(x, s)), 1);
    q[3] = up_q(plus_q(mul32_q(z, c), mul32_q(w, s)), 1);
}

/* Turns the heading until the field points north. */
static void set_north(int32_t q[4], const int16_t field[2])
{
    int32_t c = (int32_t)ONE_Q14 + field[1]; /* half of the angle: (1 + cos, sin), or (sin, 1 - cos) */
    int32_t s = field[0];
    if (field[1] < 0) {
        c = abs_q(field[0]);
        s = field[0] < 0 ? (int32_t)field[1] - ONE_Q14 : (int32_t)ONE_Q14 - field[1];
    }
    uint32_t squared = (uint32_t)(c * c) + (uint32_t)(s * s);
    while (squared < 0x40000000UL) {
        squared <<= 2;
        c *= 2;
        s *= 2;
    }
    const int32_t inverse = inverse_sqrt_q(squared); /* too small by a hair: c and s stay below 1 */
    turn_about_vertical(q, c * inverse, s * inverse);
}

/* What the field says: the heading's error, Q14, and the periods it stands for; 0 periods: nothing. */
static uint16_t heard(struct mahony_q9_state *s, const struct mahony_q9_derived *d, const struct rows_q *rows,
                      const int16_t mag[3], int16_t *error)
{
    int16_t field[2];
    if (!horizontal(rows, mag, field)) {
        return 0;
    }
    const uint16_t stands_for = s->field_age < d->oldest_periods ? s->field_age : d->oldest_periods;
    s->field_age = 0;
    if (!s->heading_known) {
        set_north(s->tilt.q, field);
        s->heading_known = 1;
        return 0;
    }
    if (field[1] >= d->gate) {
        s->outside = 0;
    } else {
        const uint16_t longer = (uint16_t)(s->outside + stands_for);
        s->outside = longer < stands_for ? UINT16_MAX : longer;
        if (s->outside <= d->timeout_periods) {
            return 0;
        }
    }
    *error = field[0];
    if (field[1] <= 0) {
        *error = field[0] < 0 ? -ONE_Q14 : ONE_Q14;
    }
    return stands_for;
}

/* What the error turns and draws, the quick start counted down. */
static void add(const struct mahony_q9_state *s, const struct mahony_q9_derived *d, int16_t error,
                uint16_t stands_for, uint8_t periods, struct mahony_q_heading *heading)
{
    const uint16_t boost = (uint16_t)(((uint32_t)d->tilt.boost * s->tilt.start_left) >> 8); /* Q18 */
    const int32_t half = plus_q(mul16u_q(error, d->heading_gain) >> 8, mul16u_q(error, boost)); /* Q32 */
    const int32_t change = plus_q(mul16u_q(error, d->tilt.weights.integral), 0x80) >> 8;        /* Q32 */
    heading->half = clamp_q(clamp_q(half, MOST / stands_for) * stands_for / periods, TURNED);
    heading->bias = clamp_q(change, TURNED / stands_for) * stands_for;
}

void mahony_q_step_9d(struct mahony_q9_state *s, const struct mahony_q9_derived *d,
                      const struct imu_q *sample, uint8_t periods)
{
    struct rows_q rows;
    struct mahony_q_weights several;
    struct mahony_q_heading heading = {0, 0};
    int16_t error = 0;
    const uint16_t age = (uint16_t)(s->field_age + periods);
    s->field_age = age < periods ? UINT16_MAX : age;
    rows_q(s->tilt.q, &rows);
    const uint16_t stands_for = heard(s, d, &rows, sample->mag, &error);
    if (periods == 0U || periods > d->tilt.pause_periods) {
        mahony_q_step(&s->tilt, &d->tilt, sample, periods);
        return;
    }
    const uint16_t gain = mahony_q_worth(&s->tilt, &d->tilt, periods, &several);
    if (stands_for != 0U) {
        add(s, d, error, stands_for, periods, &heading);
    }
    mahony_q_update_heading(&s->tilt, &d->tilt, sample, periods == 1U ? &d->tilt.weights : &several, gain,
                            &heading);
    if (s->outside != 0U) {
        s->tilt.status |= MAHONY_Q_MAG_DISTURBED;
    }
}

void mahony_q_start_9d(struct mahony_q9_state *s, const struct mahony_q9_derived *d,
                       const struct imu_q *first)
{
    mahony_q_start(&s->tilt, &d->tilt, first);
    s->field_age = 0;
    s->outside = 0;
    s->heading_known = 0;
}

void mahony_q_attitude_9d(const struct mahony_q9_state *s, int32_t world_q_body[4])
{
    mahony_q_attitude(&s->tilt, world_q_body);
}
