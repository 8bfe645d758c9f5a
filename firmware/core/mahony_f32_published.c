#include "mahony_f32.h"

#include "blocks_f32.h"

void mahony_f32_step_published(struct mahony_f32_state *restrict s,
                               const struct mahony_f32_derived *restrict d,
                               const struct imu_f32 *restrict sample, float dt)
{
    struct quaternion_f32 q;
    struct vector_f32 gyro, accel, bias, r;
    LOAD_VECTORS_F32(sample->gyro, sample->accel, gyro, accel, s10, s11, s12, s13, s14, s15);
    if (RARELY_F32(!is_rate_f32(gyro))) {
        return;
    }
    if (RARELY_F32(!steady_f32(dt))) {
        dt = 0.0f;
    }
    r = scaled_f32(gyro, dt);
    LOAD_ATTITUDE_F32(s->world_q_body, s->gyro_bias, q, bias, s1, s2, s3, s4, s5, s6, s7);
    const float force = dot_f32(accel, accel);
    if (usable_f32(force)) {
        const float times = dt / sqrtf(force);
        const struct vector_f32 error = cross_f32(accel, half_up_f32(q));
        bias = limited_f32(minus_f32(bias, error, d->gains[2] * times), d->bias_limit, d->bias_bound);
        r = plus_f32(r, error, d->gains[0] * times);
    }
    r = minus_f32(r, bias, dt);
    q = turned_f32(q, scaled_f32(r, 0.5f + d->third * dot_f32(r, r)));
    STORE_ATTITUDE_F32(s->world_q_body, s->gyro_bias, q, bias, s1, s2, s3, s4, s5, s6, s7);
}
