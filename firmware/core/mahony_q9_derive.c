/* The constants of mahony_q9.h for one rate, in single precision. */
#include "mahony_q9.h"

#define OLDEST 0.2F     /* s */
#define HALF_TURN 3.14F /* rad */

/* cos(x) for 0 <= x <= pi to 1e-6, by the sine of a quarter. */
static float cosine(float x)
{
    const float quarter = 0.25F * x;
    const float square = quarter * quarter;
    const float fine = 1.0F - square / 42.0F * (1.0F - square / 72.0F);
    const float sine = quarter * (1.0F - square / 6.0F * (1.0F - square / 20.0F * fine));
    const float half = 1.0F - 2.0F * sine * sine;
    return 2.0F * half * half - 1.0F;
}

static uint16_t rounded(float value, uint16_t most)
{
    if (!(value >= 0.5F)) {
        return 0;
    }
    return value < (float)most ? (uint16_t)(value + 0.5F) : most;
}

void mahony_q_defaults_9d(struct mahony_q9_settings *settings)
{
    mahony_q_defaults(&settings->tilt);
    settings->heading_gain = 0.05F;
    settings->heading_gate = 0.34906585F;
    settings->heading_timeout = 20.0F;
}

void mahony_q_derive_9d(const struct mahony_q9_settings *settings, uint16_t rate_hz,
                        struct mahony_q9_derived *derived)
{
    mahony_q_derive(&settings->tilt, rate_hz, &derived->tilt);
    /* as mahony_q_derive */
    const float rate = (float)(rate_hz < 72U ? 72U : (rate_hz > 1000U ? 1000U : rate_hz));
    derived->heading_gain = rounded(settings->heading_gain / (2.0F * rate) * 67108864.0F, UINT16_MAX);
    derived->timeout_periods = rounded(settings->heading_timeout * rate, UINT16_MAX);
    derived->oldest_periods = rounded(OLDEST * rate, UINT16_MAX);
    derived->gate = INT16_MIN;
    if (settings->heading_gate < HALF_TURN) {
        const float gate = settings->heading_gate > 0.0F ? settings->heading_gate : 0.0F;
        const float cos_gate = cosine(gate) * 16384.0F;
        derived->gate = (int16_t)(cos_gate < 0.0F ? cos_gate - 0.5F : cos_gate + 0.5F);
    }
}
