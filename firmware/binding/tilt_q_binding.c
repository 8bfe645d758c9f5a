/* The tilt Kalman filter in fixed point, for Python: binding.h says how. */
#include "fixed_binding.h"
#include "tilt_q.h"

#include <string.h>

#define HEAD 4 /* doubles before the struct: the quaternion */
#define BIAS_UNIT 16777216.0 /* Q24 */

/* In the order of the fields of the Python filter. */
static void derive(const double *p, double rate_hz, struct tilt_q_derived *derived)
{
    struct tilt_q_settings s;
    s.gyro_density = (float)p[0];
    s.bias_walk = (float)p[1];
    s.tilt_sigma = (float)p[2];
    s.heading_sigma = (float)p[3];
    s.nis_gate = (float)p[4];
    s.bias_sigma = (float)p[5];
    s.bias_limit = (float)p[6];
    tilt_q_derive(&s, (uint16_t)rate_hz, derived);
}

void binding_tilt_q_run(const double *settings, const struct recording *in, const struct answer *out)
{
    struct tilt_q_derived derived;
    struct tilt_q_state state;
    struct fixed_sample sample = fixed_row(in, 0);
    derive(settings, in->rate_hz, &derived);
    tilt_q_start(&state, &derived, &sample.imu);
    for (int64_t k = 0; k < in->count; k++) {
        int32_t q[4], bias[3];
        sample = fixed_row(in, k);
        tilt_q_step(&state, &derived, &sample.imu, sample.periods);
        tilt_q_attitude(&state, q);
        store_q30(out->world_q_body, k, q);
        tilt_q_gyro_bias(&state, &derived, bias);
        for (int i = 0; i < 3; i++) {
            out->bias[3 * k + i] = (double)bias[i] / BIAS_UNIT;
        }
        out->disturbed[k] = (state.status & TILT_Q_MAG_DISTURBED) != 0;
    }
}

static void pack(const struct tilt_q_state *own, double *state)
{
    int32_t q[4];
    tilt_q_attitude(own, q);
    store_q30(state, 0, q);
    memcpy(state + HEAD, own, sizeof *own);
}

int32_t binding_tilt_q_state_size(void)
{
    return (int32_t)(HEAD + (sizeof(struct tilt_q_state) + sizeof(double) - 1) / sizeof(double));
}

void binding_tilt_q_start(const double *settings, double rate_hz, const double sample[9], double *state)
{
    const struct fixed_sample first = fixed_sample(sample, sample + 3, sample + 6, 0.0, rate_hz);
    struct tilt_q_derived derived;
    struct tilt_q_state own;
    derive(settings, rate_hz, &derived);
    tilt_q_start(&own, &derived, &first.imu);
    pack(&own, state);
}

/* A gyro that is no number leaves the state as it is. */
void binding_tilt_q_step(const double *settings, double rate_hz, const double sample[9], double dt, double *state)
{
    const struct fixed_sample next = fixed_sample(sample, sample + 3, sample + 6, dt, rate_hz);
    struct tilt_q_derived derived;
    struct tilt_q_state own;
    derive(settings, rate_hz, &derived);
    memcpy(&own, state + HEAD, sizeof own);
    if (next.usable) {
        tilt_q_step(&own, &derived, &next.imu, next.periods);
    }
    pack(&own, state);
}
