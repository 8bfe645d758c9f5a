/* A sample into the sums of the error-state filter: turn by the gyro, turn force and field likewise. */
#include "error_state_parts_f32.h"

/* Squares of lengths that sensors read: from 2^-60 up, to 2^27 of a force and to 2^60 of a field. */
#define LEAST_SQUARE UINT32_C(0x21800000) /* bits of 2^-60 */
#define FORCE_SPAN UINT32_C(0x2B800000)   /* bits of 2^27, less those */
#define FIELD_SPAN UINT32_C(0x3C000000)   /* bits of 2^60, less those */

/* Whether a vector is a reading; no for NaN, infinity and zero. */
ONCE_F32
static int reads(const float v[3], uint32_t span)
{
    return bits_f32(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) - LEAST_SQUARE < span;
}

int error_state_f32_force_usable(const float force[3])
{
    return reads(force, FORCE_SPAN);
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
INLINE_F32 void integrate(struct error_state_f32_state *restrict s, const float rate[3], float dt)
{
    float by[4], rate_squared = 0.0f, squared = 0.0f, scale;
    int i;
    for (i = 0; i < 3; i++) {
        const float bias = s->tilt[3 + i], now = rate[i] - bias;
        by[1 + i] = 0.5f * dt * (now + (s->last_rate[i] - bias));
        rate_squared += now * now;
        squared += by[1 + i] * by[1 + i];
        s->last_rate[i] = rate[i];
        s->sums.rate[i] += rate[i];
    }
    s->sums.rate_squared += rate_squared;
    scale = 0.5f + (0.5f / 12.0f) * squared;
    by[0] = 1.0f;
    by[1] *= scale;
    by[2] *= scale;
    by[3] *= scale;
    error_state_f32_multiply(s->turn, by, s->turn);
    error_state_f32_normalise(s->turn, 4);
}

SELDOM_F32
void error_state_f32_gather(struct error_state_f32_state *restrict s, const struct imu_f32 *restrict sample,
                            float dt)
{
    struct error_state_f32_sums *sums = &s->sums;
    float matrix[9];
    int i;
    integrate(s, sample->gyro, dt);
    error_state_f32_rotation(s->turn, matrix);
    for (i = 0; i < 9; i++) {
        sums->turned[i] += matrix[i];
    }
    sums->samples += 1.0f;
    sums->elapsed += dt;
    if (reads(sample->accel, FORCE_SPAN)) {
        error_state_f32_add_turned(sums->force, matrix, sample->accel);
        for (i = 0; i < 3; i++) {
            sums->specific[i] += sample->accel[i];
        }
        sums->forces += 1.0f;
    }
    if (reads(sample->mag, FIELD_SPAN) && is_news(s->last_field, sample->mag)) {
        error_state_f32_add_turned(sums->field, matrix, sample->mag);
        sums->fields += 1.0f;
    }
}
