#include "mahony_f32.h"

#include "turning_f32.h"

void mahony_f32_step_published(struct mahony_f32_state *restrict s,
                               const struct mahony_f32_derived *restrict d,
                               const struct imu_f32 *restrict sample, float dt)
{
    const struct vector_f32 gyro = load_vector_f32(sample->gyro), accel = load_vector_f32(sample->accel);
    if (RARELY_F32(!is_rate_f32(gyro))) {
        return;
    }
    if (RARELY_F32(!steady_f32(dt))) {
        dt = 0.0f;
    }
    const struct quaternion_f32 q = load_quaternion_f32(s->world_q_body);
    struct vector_f32 bias = load_vector_f32(s->gyro_bias), r = scaled_f32(gyro, dt);
    const float force = dot_f32(accel, accel);
    if (usable_f32(force)) {
        const float times = 2.0f * dt / sqrtf(force);
        const struct vector_f32 error = cross_f32(accel, half_up_f32(q));
        bias = limited_f32(minus_f32(bias, error, d->integral_gain * times), d->bias_limit, d->bias_bound);
        r = plus_f32(r, error, d->gain * times);
        store_vector_f32(s->gyro_bias, bias);
    }
    r = minus_f32(r, bias, dt);
    store_quaternion_f32(s->world_q_body, turned_f32(q, scaled_f32(r, 0.5f + d->third * dot_f32(r, r))));
}
