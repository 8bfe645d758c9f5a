/* The constants of mahony_q.h for one rate, in single precision: it runs once. */
#include "mahony_q.h"

#define LOW_TIME 0.5F /* s, time constant of what rest is judged by */
#define PAUSE 1U      /* s */

/* value times 2^q, rounded, from 0 to `most`. */
static uint32_t fixed(float value, uint8_t q, uint32_t most)
{
    const float scaled = value * (float)(1ULL << q);
    if (!(scaled >= 0.5F)) {
        return 0;
    }
    return scaled < (float)most ? (uint32_t)(scaled + 0.5F) : most;
}

void mahony_q_defaults(struct mahony_q_settings *settings)
{
    settings->gain = 0.5F;
    settings->integral_gain = 0.0005F;
    settings->bias_limit = 0.1F;
    settings->error_limit = 0.05F;
    settings->lasting_time = 20.0F;
    settings->start_gain = 10.0F;
    settings->start_time = 3.0F;
    settings->rest_gyro = 0.035F;
    settings->rest_accel = 0.5F;
    settings->rest_time = 1.5F;
    settings->rest_constant = 1.0F;
}

void mahony_q_derive(const struct mahony_q_settings *settings, uint16_t rate_hz, struct mahony_q_derived *d)
{
    const uint16_t hz = rate_hz < 72U ? 72U : (rate_hz > 1000U ? 1000U : rate_hz);
    const float rate = (float)hz;
    const float start_periods = settings->start_time * rate;
    const float boost = (settings->start_gain - settings->gain) / (2.0F * rate);
    d->half_period = (uint32_t)((0x40000000UL + hz / 2U) / hz);
    d->bias_limit = (int32_t)fixed(settings->bias_limit, 32, 0x3D70A3D7UL);
    d->rest_gyro = (int32_t)fixed(settings->rest_gyro, 16, 0x7FFFUL);
    d->rest_accel = (int32_t)fixed(settings->rest_accel, 8, 0x3FFFUL);
    d->start_periods = (uint16_t)fixed(start_periods, 0, UINT16_MAX);
    d->gain = (uint16_t)fixed(settings->gain / (2.0F * rate), 18, 20000U);
    d->boost = (uint16_t)fixed(d->start_periods > 0U ? boost / start_periods : 0.0F, 26, UINT16_MAX);
    d->weights.integral = (uint16_t)fixed(settings->integral_gain / rate, 26, UINT16_MAX);
    d->error_limit = (uint16_t)fixed(settings->error_limit, 14, 19000U);
    d->weights.lasting = (uint16_t)fixed(1.0F / (settings->lasting_time * rate + 1.0F), 24, UINT16_MAX);
    d->weights.low = (uint16_t)fixed(1.0F / (LOW_TIME * rate + 1.0F), 16, UINT16_MAX);
    d->weights.rest = (uint16_t)fixed(1.0F / (settings->rest_constant * rate + 1.0F), 16, UINT16_MAX);
    d->low_periods = (uint16_t)fixed(LOW_TIME * rate, 0, UINT16_MAX);
    d->constant_periods = (uint16_t)fixed(settings->rest_constant * rate, 0, UINT16_MAX);
    d->rest_periods = (uint16_t)fixed(settings->rest_time * rate, 0, UINT16_MAX);
    d->pause_periods = (uint16_t)(PAUSE * hz > 254U ? 254U : PAUSE * hz);
    d->weights.periods = 1;
    d->gyro_limit = (int8_t)(hz < 92U ? 7U * hz / 10U : 64U);
}
