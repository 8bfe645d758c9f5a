#include "tilt_f32.h"

#include "angles_f32.h"
#include "trig_f32.h"
#include "vector_f32.h"

#include <math.h>

#define UNKNOWN (PI_F32 * PI_F32) /* rad^2, variance of an angle that nothing is known about */
#define STEEP 0.05f               /* cosine of the pitch that rates of roll and yaw are at least divided by */

/* One channel over dt. */
static void predict(struct tilt_f32_state *restrict s, int i, float rate, float dt,
                    const struct tilt_f32_derived *restrict d)
{
    const float both = s->covariance[i], bias = s->bias_variance[i];
    s->angle[i] += (rate - s->bias[i]) * dt;
    s->angle_variance[i] += dt * (d->gyro_power - 2.0f * both + dt * (bias + d->bias_power_third * dt));
    s->covariance[i] = both - dt * (bias + 0.5f * d->bias_power * dt);
    s->bias_variance[i] = bias + d->bias_power * dt;
}

/* One channel by a measured angle: the innovation is taken the short way round. */
static void correct(struct tilt_f32_state *restrict s, int i, float measured, float variance, float gate)
{
    const float innovation = wrapped_f32(measured - s->angle[i]);
    const float total = s->angle_variance[i] + variance;
    if (!(innovation * innovation <= gate * total)) {
        return;
    }
    const float both = s->covariance[i], gain = s->angle_variance[i] / total, bias_gain = both / total;
    const float left = s->bias_variance[i] - both * bias_gain;
    s->angle[i] += gain * innovation;
    s->bias[i] += bias_gain * innovation;
    s->angle_variance[i] = gain * variance;
    s->covariance[i] = bias_gain * variance;
    s->bias_variance[i] = left > 0.0f ? left : 0.0f;
}

/* Angles in their ranges: over the top, pitch comes back down and roll and yaw turn by half a turn. */
static void fold(struct tilt_f32_state *s)
{
    s->angle[1] = wrapped_f32(s->angle[1]);
    if (s->angle[1] > 0.5f * PI_F32 || s->angle[1] < -0.5f * PI_F32) {
        s->angle[1] = wrapped_f32(PI_F32 - s->angle[1]);
        s->bias[1] = -s->bias[1];
        s->angle[0] += PI_F32;
        s->angle[2] += PI_F32;
    }
    s->angle[0] = wrapped_f32(s->angle[0]);
    s->angle[2] = wrapped_f32(s->angle[2]);
}

/* Roll and pitch at which gravity alone would give this specific force. */
static void lean(const float accel[3], float *roll, float *pitch)
{
    *roll = atan2_f32(accel[1], accel[2]);
    *pitch = atan2_f32(-accel[0], sqrtf(accel[1] * accel[1] + accel[2] * accel[2]));
}

/* Every channel over dt: the gyro's rates, turned into those of the angles. */
static void predict_all(struct tilt_f32_state *restrict s, const float gyro[3], float dt,
                        const struct tilt_f32_derived *restrict d)
{
    float sr, cr, sp, cp;
    sin_cos_f32(s->angle[0], &sr, &cr);
    sin_cos_f32(s->angle[1], &sp, &cp);
    cp = cp > STEEP ? cp : STEEP;
    const float around = (sr * gyro[1] + cr * gyro[2]) / cp;
    predict(s, 0, gyro[0] + sp * around, dt, d);
    predict(s, 1, cr * gyro[1] - sr * gyro[2], dt, d);
    predict(s, 2, around, dt, d);
    fold(s);
}

/* Yaw by the field, levelled by roll and pitch. */
static void correct_yaw(struct tilt_f32_state *restrict s, const float mag[3],
                        const struct tilt_f32_derived *restrict d)
{
    float sr, cr, sp, cp;
    sin_cos_f32(s->angle[0], &sr, &cr);
    sin_cos_f32(s->angle[1], &sp, &cp);
    const float yaw = atan2_f32(mag[0] * cp + (mag[1] * sr + mag[2] * cr) * sp, mag[1] * cr - mag[2] * sr);
    if (s->heading_known) {
        correct(s, 2, yaw, d->heading_variance, d->nis_gate);
        s->angle[2] = wrapped_f32(s->angle[2]);
    } else {
        s->angle[2] = yaw;
        s->angle_variance[2] = d->heading_variance;
        s->covariance[2] = 0.0f;
        s->heading_known = 1;
    }
}

void tilt_f32_step(struct tilt_f32_state *restrict s, const struct tilt_f32_derived *restrict d,
                   const struct imu_f32 *restrict sample, float dt)
{
    const struct vector_f32 accel = load_vector_f32(sample->accel), mag = load_vector_f32(sample->mag);
    float roll, pitch;
    if (!is_rate_f32(load_vector_f32(sample->gyro))) {
        return;
    }
    if (!steady_f32(dt)) {
        dt = 0.0f;
        for (int i = 0; i < 3; i++) {
            s->angle_variance[i] = UNKNOWN;
            s->covariance[i] = 0.0f;
        }
    }
    predict_all(s, sample->gyro, dt, d);
    if (usable_f32(dot_f32(accel, accel)) && dt > 0.0f) {
        lean(sample->accel, &roll, &pitch);
        correct(s, 0, roll, d->tilt_variance, d->nis_gate);
        correct(s, 1, pitch, d->tilt_variance, d->nis_gate);
        fold(s);
    }
    if (usable_f32(dot_f32(mag, mag))) {
        correct_yaw(s, sample->mag, d);
    }
}

void tilt_f32_start(struct tilt_f32_state *restrict s, const struct tilt_f32_derived *restrict d,
                    const struct imu_f32 *restrict first)
{
    const struct vector_f32 accel = load_vector_f32(first->accel);
    const int good = usable_f32(dot_f32(accel, accel));
    memset(s, 0, sizeof *s);
    if (good) {
        lean(first->accel, &s->angle[0], &s->angle[1]);
    }
    for (int i = 0; i < 3; i++) {
        s->angle_variance[i] = good && i < 2 ? d->tilt_variance : UNKNOWN;
        s->bias_variance[i] = d->first_variance;
    }
}

void tilt_f32_attitude(const struct tilt_f32_state *s, float world_q_body[4])
{
    attitude_from_angles_f32(s->angle, world_q_body);
}

void tilt_f32_gyro_bias(const struct tilt_f32_state *restrict s, float gyro_bias[3])
{
    float sr, cr, sp, cp;
    sin_cos_f32(s->angle[0], &sr, &cr);
    sin_cos_f32(s->angle[1], &sp, &cp);
    gyro_bias[0] = s->bias[0] - sp * s->bias[2];
    gyro_bias[1] = cr * s->bias[1] + sr * cp * s->bias[2];
    gyro_bias[2] = cr * cp * s->bias[2] - sr * s->bias[1];
}

void tilt_f32_defaults(struct tilt_f32_settings *settings)
{
    settings->gyro_density = 2e-3f;
    settings->bias_walk = 1e-4f;
    settings->tilt_sigma = 0.1f;
    settings->heading_sigma = 0.3f;
    settings->nis_gate = INFINITY;
    settings->bias_sigma = 0.05f;
}

void tilt_f32_derive(const struct tilt_f32_settings *restrict settings,
                     struct tilt_f32_derived *restrict derived)
{
    derived->gyro_power = settings->gyro_density * settings->gyro_density;
    derived->bias_power = settings->bias_walk * settings->bias_walk;
    derived->bias_power_third = derived->bias_power / 3.0f;
    derived->tilt_variance = settings->tilt_sigma * settings->tilt_sigma;
    derived->heading_variance = settings->heading_sigma * settings->heading_sigma;
    derived->nis_gate = settings->nis_gate;
    derived->first_variance = settings->bias_sigma * settings->bias_sigma;
}
