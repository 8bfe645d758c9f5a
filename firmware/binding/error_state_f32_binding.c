/* The error-state filter in single precision, for Python: binding.h says how. */
#include "binding.h"
#include "error_state_f32.h"

#include <string.h>

#define HEAD 4 /* doubles before the struct: the quaternion */

/* In the order of the fields of the Python filter. */
static void derive(const double *p, struct error_state_f32_derived *derived)
{
    struct error_state_f32_settings s;
    s.block = (float)p[0];
    s.gyro_noise = (float)p[1];
    s.tilt_scale = (float)p[2];
    s.heading_scale = (float)p[3];
    s.bias_walk = (float)p[4];
    s.bias_sigma = (float)p[5];
    s.motion_bandwidth = (float)p[6];
    s.motion_spread = (float)p[7];
    s.motion_floor = (float)p[8];
    s.motion_time = (float)p[9];
    s.velocity_sigma = (float)p[10];
    s.position_sigma = (float)p[11];
    s.gravity = (float)p[12];
    s.rest_rate_change = (float)p[13];
    s.rest_force_change = (float)p[14];
    s.rest_rate = (float)p[15];
    s.rest_time = (float)p[16];
    s.rest_filter = (float)p[17];
    s.rest_noise = (float)p[18];
    s.field_noise = (float)p[19];
    s.field_gate = (float)p[20];
    s.field_doubt = (float)p[21];
    s.bias_memory = (float)p[22];
    s.iron_sigma = (float)p[23];
    s.iron_walk = (float)p[24];
    s.iron_doubt = (float)p[25];
    s.reference_sigma = (float)p[26];
    s.reference_walk = (float)p[27];
    s.delay = (float)p[28];
    s.delay_sigma = (float)p[29];
    s.latency = (float)p[30];
    s.latency_sigma = (float)p[31];
    s.tilt_floor = (float)p[32];
    s.heading_floor = (float)p[33];
    s.start_tilt_sigma = (float)p[34];
    s.start_heading_sigma = (float)p[35];
    s.start_known = (float)p[36];
    s.start_motion = (float)p[37];
    s.gap = (float)p[38];
    error_state_f32_derive(&s, derived);
}

static void store(const struct answer *out, int64_t k, const struct error_state_f32_state *state,
                  const struct error_state_f32_derived *derived)
{
    float numbers[9];
    error_state_f32_attitude(state, numbers);
    store_quaternion(out->world_q_body, k, numbers);
    error_state_f32_heading_free(state, numbers);
    store_quaternion(out->heading_free, k, numbers);
    error_state_f32_bias(state, numbers);
    store_row(out->bias, k, 3, numbers);
    error_state_f32_covariance(state, derived, numbers);
    store_row(out->cov, k, 9, numbers);
    error_state_f32_covariance_6d(state, derived, numbers);
    store_row(out->cov_6d, k, 9, numbers);
    error_state_f32_bias_covariance(state, numbers);
    store_row(out->bias_cov, k, 9, numbers);
    out->rest[k] = state->resting;
    out->disturbed[k] = state->disturbed;
}

void binding_error_state_f32_run(const double *settings, const struct recording *in, const struct answer *out)
{
    struct error_state_f32_derived derived;
    struct error_state_f32_state state;
    struct imu_f32 sample;
    derive(settings, &derived);
    load_row_f32(&sample, in, 0);
    error_state_f32_start(&state, &derived, &sample);
    for (int64_t k = 0; k < in->count; k++) {
        load_row_f32(&sample, in, k);
        error_state_f32_step(&state, &derived, &sample, (float)interval(in, k));
        store(out, k, &state, &derived);
    }
}

static void pack(const struct error_state_f32_state *own, double *state)
{
    float q[4];
    error_state_f32_attitude(own, q);
    store_quaternion(state, 0, q);
    memcpy(state + HEAD, own, sizeof *own);
}

int32_t binding_error_state_f32_state_size(void)
{
    return (int32_t)(HEAD + (sizeof(struct error_state_f32_state) + sizeof(double) - 1) / sizeof(double));
}

void binding_error_state_f32_start(const double *settings, double rate_hz, const double sample[9], double *state)
{
    struct error_state_f32_derived derived;
    struct error_state_f32_state own;
    struct imu_f32 first;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&first, sample, sample + 3, sample + 6);
    error_state_f32_start(&own, &derived, &first);
    pack(&own, state);
}

void binding_error_state_f32_step(const double *settings, double rate_hz, const double sample[9], double dt,
                                  double *state)
{
    struct error_state_f32_derived derived;
    struct error_state_f32_state own;
    struct imu_f32 next;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&next, sample, sample + 3, sample + 6);
    memcpy(&own, state + HEAD, sizeof own);
    error_state_f32_step(&own, &derived, &next, (float)dt);
    pack(&own, state);
}
