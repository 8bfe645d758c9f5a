/* The complementary filter in fixed point, for Python: binding.h says how. */
#include "fixed_binding.h"
#include "complementary_q.h"

#include <string.h>

#define HEAD 4 /* doubles before the struct: the quaternion */

/* In the order of the fields of the Python filter. */
static void derive(const double *p, double rate_hz, struct complementary_q_derived *derived)
{
    struct complementary_q_settings s;
    s.time_constant = (float)p[0];
    s.heading_time_constant = (float)p[1];
    complementary_q_derive(&s, (uint16_t)rate_hz, derived);
}

void binding_complementary_q_run(const double *settings, const struct recording *in, const struct answer *out)
{
    struct complementary_q_derived derived;
    struct complementary_q_state state;
    struct fixed_sample sample = fixed_row(in, 0);
    derive(settings, in->rate_hz, &derived);
    complementary_q_start(&state, &derived, &sample.imu);
    for (int64_t k = 0; k < in->count; k++) {
        int32_t q[4];
        sample = fixed_row(in, k);
        complementary_q_step(&state, &derived, &sample.imu, sample.periods);
        complementary_q_attitude(&state, q);
        store_q30(out->world_q_body, k, q);
    }
}

static void pack(const struct complementary_q_state *own, double *state)
{
    int32_t q[4];
    complementary_q_attitude(own, q);
    store_q30(state, 0, q);
    memcpy(state + HEAD, own, sizeof *own);
}

int32_t binding_complementary_q_state_size(void)
{
    return (int32_t)(HEAD + (sizeof(struct complementary_q_state) + sizeof(double) - 1) / sizeof(double));
}

void binding_complementary_q_start(const double *settings, double rate_hz, const double sample[9], double *state)
{
    const struct fixed_sample first = fixed_sample(sample, sample + 3, sample + 6, 0.0, rate_hz);
    struct complementary_q_derived derived;
    struct complementary_q_state own;
    derive(settings, rate_hz, &derived);
    complementary_q_start(&own, &derived, &first.imu);
    pack(&own, state);
}

/* A gyro that is no number leaves the state as it is. */
void binding_complementary_q_step(const double *settings, double rate_hz, const double sample[9], double dt, double *state)
{
    const struct fixed_sample next = fixed_sample(sample, sample + 3, sample + 6, dt, rate_hz);
    struct complementary_q_derived derived;
    struct complementary_q_state own;
    derive(settings, rate_hz, &derived);
    memcpy(&own, state + HEAD, sizeof own);
    if (next.usable) {
        complementary_q_step(&own, &derived, &next.imu, next.periods);
    }
    pack(&own, state);
}
