#include "complementary_f32.h"

#include "trig_f32.h"
#include "turning_f32.h"

#define STEEP_SQUARED 1e-6f /* sin^2 of the angle to the vertical below which a field has no heading */

/* q exp(r) for a rotation vector of the body frame. */
static struct quaternion_f32 exactly_turned(struct quaternion_f32 q, struct vector_f32 r)
{
    const float angle = sqrtf(dot_f32(r, r));
    float sine, cosine;
    if (!(angle > 0.0f)) {
        return q;
    }
    sin_cos_f32(0.5f * angle, &sine, &cosine);
    return multiplied_f32(q, cosine, scaled_f32(r, sine / angle));
}

/* Close a share of the angle between the vertical and the specific force. */
static struct quaternion_f32 leant(struct quaternion_f32 q, struct vector_f32 accel, float squared,
                                   float share)
{
    const struct vector_f32 up = scaled_f32(half_up_f32(q), 2.0f);
    const struct vector_f32 unit = scaled_f32(accel, 1.0f / sqrtf(squared)), axis = cross_f32(unit, up);
    const float across = sqrtf(dot_f32(axis, axis));
    if (!(across > 0.0f)) {
        return q;
    }
    return exactly_turned(q, scaled_f32(axis, share * atan2_f32(across, dot_f32(unit, up)) / across));
}

/* Close a share of the heading error; all of the first. */
static struct quaternion_f32 headed(struct complementary_f32_state *restrict s,
                                    const struct complementary_f32_derived *restrict d,
                                    struct quaternion_f32 q, struct vector_f32 mag)
{
    const struct level_rows_f32 rows = level_rows_f32(q);
    const float east = 2.0f * dot_f32(rows.east, mag), north = 2.0f * dot_f32(rows.north, mag);
    const float level = east * east + north * north;
    float share = 1.0f, sine, cosine;
    if (!(level > STEEP_SQUARED * dot_f32(mag, mag)) || !usable_f32(level)) {
        return q;
    }
    if (s->heading_known) {
        share = decay_f32(s->since_field * d->heading_rate);
    }
    s->since_field = 0.0f;
    s->heading_known = 1;
    sin_cos_f32(share * atan2_f32(east, north), &sine, &cosine);
    return north_set_f32(q, sine, cosine);
}

void complementary_f32_step(struct complementary_f32_state *restrict s,
                            const struct complementary_f32_derived *restrict d,
                            const struct imu_f32 *restrict sample, float dt)
{
    const struct vector_f32 gyro = load_vector_f32(sample->gyro), accel = load_vector_f32(sample->accel);
    const float force = dot_f32(accel, accel);
    struct quaternion_f32 q = load_quaternion_f32(s->world_q_body);
    if (!is_rate_f32(gyro)) {
        return;
    }
    if (!steady_f32(dt)) {
        dt = 0.0f;
    }
    q = exactly_turned(q, scaled_f32(gyro, dt));
    if (usable_f32(force)) {
        q = leant(q, accel, force, decay_f32(dt * d->rate));
    }
    s->since_field += dt;
    q = headed(s, d, q, load_vector_f32(sample->mag));
    store_quaternion_f32(s->world_q_body, q);
}

void complementary_f32_defaults(struct complementary_f32_settings *settings)
{
    settings->time_constant = 5.0f;
    settings->heading_time_constant = 10.0f;
}

void complementary_f32_derive(const struct complementary_f32_settings *restrict settings,
                              struct complementary_f32_derived *restrict derived)
{
    derived->rate = 1.0f / settings->time_constant;
    derived->heading_rate = 1.0f / settings->heading_time_constant;
}

void complementary_f32_start(struct complementary_f32_state *restrict s,
                             const struct complementary_f32_derived *restrict d,
                             const struct imu_f32 *restrict first)
{
    (void)d;
    memset(s, 0, sizeof *s);
    store_quaternion_f32(s->world_q_body, level_f32(load_vector_f32(first->accel)));
}

void complementary_f32_attitude(const struct complementary_f32_state *s, float world_q_body[4])
{
    memcpy(world_q_body, s->world_q_body, sizeof s->world_q_body);
}
