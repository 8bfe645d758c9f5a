/* The constants of complementary_q.h for one rate, in single precision, and its beginning: they run once. */
#include "complementary_q.h"
#include "fixed_q.h"
#include "trig_q.h"

void complementary_q_defaults(struct complementary_q_settings *settings)
{
    settings->time_constant = 5.0F;
    settings->heading_time_constant = 10.0F;
}

/* 1 - exp(-x) for x > 0, Q32: a series below 1, 1 - (1 - share)^2 above. */
static uint32_t share(float x)
{
    float term = 1.0F;
    float sum = 0.0F;
    uint8_t doublings = 0;

    if (!(x < 16.0F)) {
        return 0xFFFFFF00UL;
    }
    while (x > 1.0F) {
        x *= 0.5F;
        doublings++;
    }
    for (uint8_t n = 1; n < 12U; n++) {
        term *= x / (float)n;
        sum += (n & 1U) != 0U ? term : -term;
    }
    for (; doublings > 0U; doublings--) {
        sum *= 2.0F - sum;
    }
    return sum > 0.0F ? (uint32_t)(sum * 4294967040.0F + 0.5F) : 0U;
}

void complementary_q_derive(const struct complementary_q_settings *settings, uint16_t rate_hz,
                            struct complementary_q_derived *d)
{
    const uint16_t hz = rate_hz < 40U ? 40U : (rate_hz > 1000U ? 1000U : rate_hz);
    const float rate = (float)hz;

    d->share = share(1.0F / (settings->time_constant * rate));
    d->heading_share = share(1.0F / (settings->heading_time_constant * rate));
    d->half_period = (int32_t)(68719476736.0F / rate + 0.5F);
    d->pause_periods = (uint8_t)(hz > 254U ? 254U : hz);
}

void complementary_q_start(struct complementary_q_state *s, const struct complementary_q_derived *d,
                           const struct imu_q *first)
{
    const int16_t *a = first->accel;
    int32_t sr, cr, sp, cp;
    uint32_t across;

    (void)d;
    s->q[0] = INT32_C(1) << 30;
    s->q[1] = s->q[2] = s->q[3] = 0;
    if ((a[0] | a[1] | a[2]) != 0) {
        const int32_t roll = (int32_t)polar_q32(a[1], a[2], &across);
        const int32_t pitch = (int32_t)atan2_q32(-(int32_t)a[0], (int32_t)across);

        sincos_q((uint32_t)(roll >> 1), &sr, &cr);
        sincos_q((uint32_t)(pitch >> 1), &sp, &cp);
        s->q[0] = 4 * mul32_q(cr, cp);
        s->q[1] = 4 * mul32_q(sr, cp);
        s->q[2] = 4 * mul32_q(cr, sp);
        s->q[3] = -4 * mul32_q(sr, sp);
    }
    s->since_field = 0;
    s->heading_known = 0;
    s->status = 0;
}

void complementary_q_attitude(const struct complementary_q_state *s, int32_t world_q_body[4])
{
    for (uint8_t i = 0; i < 4; i++) {
        world_q_body[i] = s->q[i];
    }
}
