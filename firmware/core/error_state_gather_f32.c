/* A sample into the sums of the error-state filter: turn by the gyro, turn force and field likewise. */
#include "error_state_parts_f32.h"

/* Squares of lengths that sensors read: from 2^-60 up, to 2^27 of a force and to 2^60 of a field. */
#define LEAST_SQUARE UINT32_C(0x21800000) /* bits of 2^-60 */
#define FORCE_SPAN UINT32_C(0x2B800000)   /* bits of 2^27, less those */
#define FIELD_SPAN UINT32_C(0x3C000000)   /* bits of 2^60, less those */

/* Whether a vector is a reading; no for NaN, infinity and zero. */
INLINE_F32 int reads(struct vector_f32 v, uint32_t span)
{
    return bits_f32(dot_f32(v, v)) - LEAST_SQUARE < span;
}

int error_state_f32_force_usable(const float force[3])
{
    return reads(load_vector_f32(force), FORCE_SPAN);
}

INLINE_F32 void add(float sum[3], struct vector_f32 v)
{
    sum[0] += v.x;
    sum[1] += v.y;
    sum[2] += v.z;
}

/* Whether a reading is new, which is kept then: one that is bit for bit the one before is a held one. */
INLINE_F32 int is_news(float last[3], const float field[3])
{
    uint32_t now[3], before[3];
    memcpy(now, field, sizeof now);
    memcpy(before, last, sizeof before);
    if (now[0] == before[0] && now[1] == before[1] && now[2] == before[2]) {
        return 0;
    }
    memcpy(last, now, sizeof now);
    return 1;
}

/* Turn half way between two readings: the rate of sampling does not shift the attitude in time. */
INLINE_F32 struct quaternion_f32 turn(struct error_state_f32_state *restrict s, const float gyro[3], float dt)
{
    const struct vector_f32 rate = load_vector_f32(gyro), bias = load_vector_f32(s->tilt + 3);
    const struct vector_f32 now = minus_f32(rate, bias, 1.0f);
    const struct vector_f32 before = minus_f32(load_vector_f32(s->last_rate), bias, 1.0f);
    const struct vector_f32 r = scaled_f32(plus_f32(now, before, 1.0f), 0.5f * dt);
    store_vector_f32(s->last_rate, rate);
    add(s->sums.rate, rate);
    s->sums.rate_squared += dot_f32(now, now);
    return turned_f32(load_quaternion_f32(s->turn), scaled_f32(r, 0.5f + (0.5f / 12.0f) * dot_f32(r, r)));
}

void error_state_f32_gather(struct error_state_f32_state *restrict s, const struct imu_f32 *restrict sample,
                            float dt)
{
    struct error_state_f32_sums *sums = &s->sums;
    const struct quaternion_f32 q = turn(s, sample->gyro, dt);
    const struct rotation_f32 r = rotation_f32(q);
    const struct vector_f32 accel = load_vector_f32(sample->accel), mag = load_vector_f32(sample->mag);
    store_quaternion_f32(s->turn, q);
    add(sums->turned, r.x);
    add(sums->turned + 3, r.y);
    add(sums->turned + 6, r.z);
    sums->samples++;
    sums->elapsed += dt;
    if (reads(accel, FORCE_SPAN)) {
        add(sums->force, rotated_f32(&r, accel));
        add(sums->specific, accel);
        sums->forces++;
    }
    if (reads(mag, FIELD_SPAN) && is_news(s->last_field, sample->mag)) {
        add(sums->field, rotated_f32(&r, mag));
        sums->fields++;
    }
}
