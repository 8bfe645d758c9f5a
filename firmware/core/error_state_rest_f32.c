/* Rest, and a force far from up: what the error-state filter watches in the means of its blocks. */
#include "error_state_parts_f32.h"

#define SETTLED 1.0f /* s over which the mean force shows roughly where up is */

/* Draw a low-passed vector to a mean; the square of what it was off by. */
ONCE_F32 SELDOM_F32
static float follow(float slow[3], const float sum[3], float per_sample, float share)
{
    float squared = 0.0f;
    int i;
    for (i = 0; i < 3; i++) {
        const float off = sum[i] * per_sample - slow[i];
        squared += off * off;
        slow[i] += share * off;
    }
    return squared;
}

/* At rest: mean rate and force of blocks stay near their low-passed values for `rest_time`. */
SELDOM_F32
void error_state_f32_watch_rest(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                float per_force)
{
    const struct error_state_f32_sums *sums = &s->sums;
    const uint32_t most = bound_f32(d->rest_rate);
    const float share = s->watching ? smaller_f32(1.0f, sums->elapsed * d->rest_share) : 1.0f;
    const float rate = follow(s->slow_rate, sums->rate, 1.0f / sums->samples, share);
    const float force = follow(s->slow_force, sums->specific, per_force, share);
    const int near = (rate <= d->rest_rate_change && force <= d->rest_force_change) || !s->watching;
    int i, slow = 1;
    for (i = 0; i < 3; i++) {
        slow &= (uint32_t)(bits_f32(s->slow_rate[i]) << 1) <= most;
    }
    s->watching = 1;
    s->still = near && slow ? smaller_f32(s->still + sums->elapsed, d->rest_time) : 0.0f;
    s->resting = s->still >= d->rest_time;
}

/* Whether the force of the last while points far from up: then level by it, and begin again. */
SELDOM_F32
int error_state_f32_overturned(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                               float per_force)
{
    float *mean = s->mean_force, length;
    s->age = smaller_f32(s->age + s->sums.elapsed, SETTLED);
    follow(mean, s->sums.force, per_force, s->sums.elapsed / s->age);
    length = sqrtf(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
    if (s->age < 0.5f * SETTLED || length < 0.5f * d->gravity || mean[2] > 0.5f * length) {
        return 0;
    }
    error_state_f32_lean_upright(s->turn, mean);
    mean[0] = 0.0f;
    mean[1] = 0.0f;
    mean[2] = length;
    error_state_f32_widen_tilt(s, d, d->tilt_prior, 0.0f);
    return 1;
}
