/* The step of mahony_q.h: what a sample counts for; the arithmetic is in mahony_q_update.c. */
#include "mahony_q.h"

#include "mahony_q_parts.h"

#ifdef __GNUC__
#define SELDOM __attribute__((noinline)) /* lest every step saves the registers that it needs */
#else
#define SELDOM
#endif

/* n / (periods + n), Q16: in a low-pass. */
static SELDOM uint16_t share(uint16_t periods, uint8_t n)
{
    return (uint16_t)(((uint32_t)n << 16) / ((uint32_t)periods + n));
}

static SELDOM uint16_t times(uint16_t weight, uint8_t n)
{
    const uint32_t product = (uint32_t)weight * n;
    return product > UINT16_MAX ? UINT16_MAX : (uint16_t)product;
}

SELDOM uint16_t mahony_q_worth(struct mahony_q_state *s, const struct mahony_q_derived *d, uint8_t periods,
                               struct mahony_q_weights *several)
{
    if (periods != 1U) {
        several->low = share(d->low_periods, periods);
        several->rest = share(d->constant_periods, periods);
        several->lasting = times(d->weights.lasting, periods);
        several->integral = times(d->weights.integral, periods);
        several->periods = periods;
    }
    s->start_left = s->start_left > periods ? (uint16_t)(s->start_left - periods) : 0U;
    return (uint16_t)(d->gain + (uint16_t)(((uint32_t)d->boost * s->start_left) >> 8));
}
#ifndef __AVR__ /* there it is in mahony_q_avr.c */
void mahony_q_step(struct mahony_q_state *s, const struct mahony_q_derived *d, const struct imu_q *sample,
                   uint8_t periods)
{
    if (periods > d->pause_periods) {
        s->start_left = d->start_periods;
        s->still = 0;
    } else if (periods != 0U) {
        struct mahony_q_weights several;
        const uint16_t gain = mahony_q_worth(s, d, periods, &several);
        mahony_q_update(s, d, sample, periods == 1U ? &d->weights : &several, gain);
    }
}
#endif

void mahony_q_attitude(const struct mahony_q_state *s, int32_t world_q_body[4])
{
    for (uint8_t i = 0; i < 4; i++) {
        world_q_body[i] = s->q[i];
    }
}
