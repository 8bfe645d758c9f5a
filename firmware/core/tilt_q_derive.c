/* The constants of tilt_q.h for one rate, in single precision: it runs once. */
#include "tilt_q.h"

#include <math.h>

#define UNKNOWN 9.8696044F /* pi^2, rad^2: variance of an angle that nothing is known about */
#define TURN 6.2831853F    /* rad */

/* value times 2^q, rounded, from 0 to `most`. */
static uint32_t fixed(float value, uint8_t q, uint32_t most)
{
    const float scaled = value * (float)(1ULL << q);

    if (!(scaled >= 0.5F)) {
        return 0;
    }
    return scaled < (float)most ? (uint32_t)(scaled + 0.5F) : most;
}

void tilt_q_defaults(struct tilt_q_settings *settings)
{
    settings->gyro_density = 2e-3F;
    settings->bias_walk = 1e-4F;
    settings->tilt_sigma = 0.1F;
    settings->heading_sigma = 0.3F;
    settings->nis_gate = INFINITY;
    settings->bias_sigma = 0.05F;
    settings->bias_limit = 1.0F;
}

static void derive_noise(const struct tilt_q_settings *settings, float sigma, float rate, struct tilt_q_noise *noise)
{
    const float relative = 1.0F / (sigma * sigma);
    const float angle = settings->gyro_density * settings->gyro_density / rate * relative;
    const float bias = settings->bias_walk * settings->bias_walk / (rate * rate * rate) * relative;
    const float first = settings->bias_sigma * settings->bias_sigma / (rate * rate) * relative;
    const float gate = settings->nis_gate * sigma * sigma / (TURN * TURN);

    /* |c| reaches 0.7 b^(2/3) after the start; it has room up to 2^-(7 + finer), b up to 2^-(8 + finer) */
    float room = first * first * 2097152.0F;
    uint8_t finer = 0;
    while (finer < 6U && room < 0.125F) {
        room *= 8.0F;
        finer++;
    }
    noise->finer = finer;
    noise->angle = fixed(angle + bias / 3.0F, 30, 0x1FFFFFFFUL);
    noise->bias = fixed(bias, (uint8_t)(54U + finer), 0xFFFFFFFFUL);
    noise->both = (int32_t)fixed(0.5F * bias, (uint8_t)(38U + finer), 0x1FFFFFFFUL);
    noise->first_bias = fixed(first, (uint8_t)(38U + finer), 0x3FFFFFFFUL);
    noise->unknown_gain = fixed(UNKNOWN / (UNKNOWN + sigma * sigma), 32, 0xFFFFFF00UL);
    noise->gate = gate < 0.125F ? fixed(gate, 32, 0x1FFFFFFFUL) : 0xFFFFFFFFUL;
}

void tilt_q_derive(const struct tilt_q_settings *settings, uint16_t rate_hz, struct tilt_q_derived *d)
{
    const uint16_t hz = rate_hz < 42U ? 42U : (rate_hz > 1000U ? 1000U : rate_hz);
    const float rate = (float)hz;

    derive_noise(settings, settings->tilt_sigma, rate, &d->noise[0]);
    derive_noise(settings, settings->heading_sigma, rate, &d->noise[1]);
    d->turn = (int32_t)fixed(128.0F / (TURN * rate), 32, 0x7FFFFFFFUL);
    d->rate = (int32_t)fixed(TURN * rate, 16, 0x7FFFFFFFUL);
    d->bias_limit = (int32_t)fixed(settings->bias_limit / (TURN * rate), 40, 0x7FFFFF00UL);
    d->pause_periods = (uint8_t)(hz > 254U ? 254U : hz);
}
