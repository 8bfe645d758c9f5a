/* The step of mahony_q.h: what a sample counts for; the arithmetic is in mahony_q_update.c. */
#include "mahony_q.h"

#include "mahony_q_parts.h"

/* n / (periods + n), Q16: in a low-pass. */
static uint16_t share(uint16_t periods, uint8_t n)
{
    return (uint16_t)(((uint32_t)n << 16) / ((uint32_t)periods + n));
}

static uint16_t times(uint16_t weight, uint8_t n)
{
    const uint32_t product = (uint32_t)weight * n;
    return product > UINT16_MAX ? UINT16_MAX : (uint16_t)product;
}

void mahony_q_step(struct mahony_q_state *s, const struct mahony_q_derived *d, const struct imu_q *sample,
                   uint8_t periods)
{
    const struct mahony_q_weights *weights = &d->weights;
    struct mahony_q_weights several;
    uint16_t gain = d->gain;

    if (periods > d->pause_periods) {
        s->start_left = d->start_periods;
        s->still = 0;
        return;
    }
    if (periods == 0U) {
        return;
    }
    if (periods != 1U) {
        several.low = share(d->low_periods, periods);
        several.rest = share(d->constant_periods, periods);
        several.lasting = times(d->weights.lasting, periods);
        several.integral = times(d->weights.integral, periods);
        several.periods = periods;
        weights = &several;
    }
    if (s->start_left != 0U) {
        s->start_left = s->start_left > periods ? (uint16_t)(s->start_left - periods) : 0U;
        gain = (uint16_t)(gain + (uint16_t)(((uint32_t)d->boost * s->start_left) >> 8));
    }
    mahony_q_update(s, d, sample, weights, gain);
}

void mahony_q_attitude(const struct mahony_q_state *s, int32_t world_q_body[4])
{
    for (uint8_t i = 0; i < 4; i++) {
        world_q_body[i] = s->q[i];
    }
}
