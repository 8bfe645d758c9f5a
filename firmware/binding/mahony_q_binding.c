/* Mahony's filter in fixed point, for Python: binding.h says how.
 *
 * A recording without magnetometer goes through mahony_q.h, the filter of the AVR; with one, through mahony_q9.h.
 */
#include "fixed_binding.h"
#include "mahony_q9.h"

#include <string.h>

#define HEAD 4 /* doubles before the struct: the quaternion */
#define BIAS_UNIT 4294967296.0 /* Q32 */

/* In the order of the fields of the Python filter. */
static void derive(const double *p, double rate_hz, struct mahony_q9_derived *derived)
{
    struct mahony_q9_settings s;
    s.tilt.gain = (float)p[0];
    s.tilt.integral_gain = (float)p[1];
    s.tilt.bias_limit = (float)p[2];
    s.tilt.error_limit = (float)p[3];
    s.tilt.lasting_time = (float)p[4];
    s.tilt.start_gain = (float)p[5];
    s.tilt.start_time = (float)p[6];
    s.tilt.rest_gyro = (float)p[7];
    s.tilt.rest_accel = (float)p[8];
    s.tilt.rest_time = (float)p[9];
    s.tilt.rest_constant = (float)p[10];
    s.heading_gain = (float)p[11];
    s.heading_gate = (float)p[12];
    s.heading_timeout = (float)p[13];
    mahony_q_derive_9d(&s, (uint16_t)rate_hz, derived);
}

static void store(const struct answer *out, int64_t k, const struct mahony_q_state *state)
{
    int32_t q[4];
    mahony_q_attitude(state, q);
    store_q30(out->world_q_body, k, q);
    for (int i = 0; i < 3; i++) {
        out->bias[3 * k + i] = (double)state->bias[i] / BIAS_UNIT;
    }
    out->rest[k] = (state->status & MAHONY_Q_REST) != 0;
    out->disturbed[k] = (state->status & MAHONY_Q_MAG_DISTURBED) != 0;
}

static void run_6d(const struct mahony_q_derived *derived, const struct recording *in, const struct answer *out)
{
    struct mahony_q_state state;
    struct fixed_sample sample = fixed_row(in, 0);
    mahony_q_start(&state, derived, &sample.imu);
    for (int64_t k = 0; k < in->count; k++) {
        sample = fixed_row(in, k);
        mahony_q_step(&state, derived, &sample.imu, sample.periods);
        store(out, k, &state);
    }
}

void binding_mahony_q_run(const double *settings, const struct recording *in, const struct answer *out)
{
    struct mahony_q9_derived derived;
    struct mahony_q9_state state;
    struct fixed_sample sample = fixed_row(in, 0);
    derive(settings, in->rate_hz, &derived);
    if (in->mag == NULL) {
        run_6d(&derived.tilt, in, out);
        return;
    }
    mahony_q_start_9d(&state, &derived, &sample.imu);
    for (int64_t k = 0; k < in->count; k++) {
        sample = fixed_row(in, k);
        mahony_q_step_9d(&state, &derived, &sample.imu, sample.periods);
        store(out, k, &state.tilt);
    }
}

static void pack(const struct mahony_q9_state *own, double *state)
{
    int32_t q[4];
    mahony_q_attitude_9d(own, q);
    store_q30(state, 0, q);
    memcpy(state + HEAD, own, sizeof *own);
}

int32_t binding_mahony_q_state_size(void)
{
    return (int32_t)(HEAD + (sizeof(struct mahony_q9_state) + sizeof(double) - 1) / sizeof(double));
}

void binding_mahony_q_start(const double *settings, double rate_hz, const double sample[9], double *state)
{
    const struct fixed_sample first = fixed_sample(sample, sample + 3, sample + 6, 0.0, rate_hz);
    struct mahony_q9_derived derived;
    struct mahony_q9_state own;
    derive(settings, rate_hz, &derived);
    mahony_q_start_9d(&own, &derived, &first.imu);
    pack(&own, state);
}

/* A gyro that is no number leaves the state as it is. */
void binding_mahony_q_step(const double *settings, double rate_hz, const double sample[9], double dt, double *state)
{
    const struct fixed_sample next = fixed_sample(sample, sample + 3, sample + 6, dt, rate_hz);
    struct mahony_q9_derived derived;
    struct mahony_q9_state own;
    derive(settings, rate_hz, &derived);
    memcpy(&own, state + HEAD, sizeof own);
    if (next.usable) {
        mahony_q_step_9d(&own, &derived, &next.imu, next.periods);
    }
    pack(&own, state);
}
