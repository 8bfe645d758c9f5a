#include "mahony_f32.h"

#include "turning_f32.h"

#define PI 3.14159265f   /* rad */

void mahony_f32_defaults(struct mahony_f32_settings *settings)
{
    settings->gain = 0.5f;
    settings->heading_gain = 0.05f;
    settings->integral_gain = 0.0005f;
    settings->bias_limit = 0.1f;
    settings->error_limit = 0.05f;
    settings->lasting_time = 20.0f;
    settings->heading_gate = PI / 9.0f;
    settings->heading_timeout = 20.0f;
    settings->start_gain = 10.0f;
    settings->start_time = 3.0f;
    settings->rest_gyro = 0.035f;
    settings->rest_accel = 0.5f;
    settings->rest_time = 1.5f;
    settings->rest_constant = 1.0f;
    settings->tilt_by_field = 0;
    settings->order = 3;
}

void mahony_f32_as_published(struct mahony_f32_settings *settings, float gain, float integral_gain)
{
    mahony_f32_defaults(settings);
    settings->gain = gain;
    settings->heading_gain = gain;
    settings->integral_gain = integral_gain;
    settings->bias_limit = INFINITY;
    settings->error_limit = INFINITY;
    settings->heading_gate = INFINITY;
    settings->start_time = 0.0f;
    settings->rest_time = INFINITY;
    settings->tilt_by_field = 1;
    settings->order = 1;
}

/* Cosine on [0, pi], by the series of the half angle; 2e-7 off at most. */
static float cosine(float angle)
{
    const float h = 0.25f * angle * angle; /* (angle / 2)^2, up to 2.47 */
    float s = 1.0f;                        /* sin(angle / 2) / (angle / 2) */
    for (int n = 12; n > 0; n -= 2) {
        s = 1.0f - h / (float)(n * (n + 1)) * s;
    }
    return 1.0f - 2.0f * h * s * s;
}

void mahony_f32_derive(const struct mahony_f32_settings *settings, struct mahony_f32_derived *derived)
{
    derived->gains[0] = 2.0f * settings->gain;
    derived->gains[1] = 2.0f * settings->heading_gain;
    derived->gains[2] = 2.0f * settings->integral_gain;
    derived->bias_limit = settings->bias_limit;
    derived->error_limit = settings->error_limit;
    derived->lasting_time = settings->lasting_time;
    derived->gate_cosine = settings->heading_gate < PI ? cosine(settings->heading_gate) : -2.0f;
    derived->gate_ahead = derived->gate_cosine > 0.0f ? derived->gate_cosine : 0.0f;
    derived->heading_timeout = settings->heading_timeout;
    derived->boost = 2.0f * (settings->start_gain - settings->gain);
    derived->start_time = settings->start_time;
    derived->start_rate = settings->start_time > 0.0f ? 1.0f / settings->start_time : 0.0f;
    derived->rest_gyro = bound_f32(settings->rest_gyro);
    derived->rest_accel = bound_f32(settings->rest_accel);
    derived->bias_bound = bound_f32(settings->bias_limit);
    derived->rest_time = settings->rest_time;
    derived->rest_constant = settings->rest_constant;
    derived->third = settings->order == 3 ? 1.0f / 24.0f : 0.0f;
    derived->tilt_by_field = settings->tilt_by_field;
}
