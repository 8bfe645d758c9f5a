/* Mahony's filter in single precision, for Python: binding.h says how. */
#include "binding.h"
#include "mahony_f32.h"

static void derive(const double *p, struct mahony_f32_derived *derived)
{
    struct mahony_f32_settings s;
    s.gain = (float)p[0];
    s.heading_gain = (float)p[1];
    s.integral_gain = (float)p[2];
    s.bias_limit = (float)p[3];
    s.error_limit = (float)p[4];
    s.lasting_time = (float)p[5];
    s.heading_gate = (float)p[6];
    s.heading_timeout = (float)p[7];
    s.start_gain = (float)p[8];
    s.start_time = (float)p[9];
    s.rest_gyro = (float)p[10];
    s.rest_accel = (float)p[11];
    s.rest_time = (float)p[12];
    s.rest_constant = (float)p[13];
    s.tilt_by_field = (uint8_t)p[14];
    s.order = (uint8_t)p[15];
    mahony_f32_derive(&s, derived);
}

void binding_mahony_f32_run(const double *settings, const struct recording *in, const struct answer *out)
{
    struct mahony_f32_derived derived;
    struct mahony_f32_state state;
    struct imu_f32 sample;
    derive(settings, &derived);
    load_row_f32(&sample, in, 0);
    mahony_f32_start(&state, &derived, &sample);
    for (int64_t k = 0; k < in->count; k++) {
        load_row_f32(&sample, in, k);
        if (in->mag == NULL) {
            mahony_f32_step_6d(&state, &derived, &sample, (float)interval(in, k));
        } else {
            mahony_f32_step(&state, &derived, &sample, (float)interval(in, k));
        }
        store_quaternion(out->world_q_body, k, state.world_q_body);
        store_row(out->bias, k, 3, state.gyro_bias);
        out->rest[k] = (uint8_t)mahony_f32_rests(&state, &derived);
        out->disturbed[k] = (uint8_t)mahony_f32_disturbed(&state);
    }
}

/* Numbers in the order of sequential/attitude/mahony_kernel.py. */
static void pack(const struct mahony_f32_state *s, double *numbers)
{
    for (int i = 0; i < 4; i++) {
        numbers[i] = (double)s->world_q_body[i];
    }
    for (int i = 0; i < 3; i++) {
        numbers[4 + i] = (double)s->gyro_bias[i];
        numbers[10 + i] = (double)s->mean_gyro[i];
        numbers[13 + i] = (double)s->mean_accel[i];
    }
    numbers[7] = (double)s->since_start;
    numbers[8] = (double)s->since_field;
    numbers[9] = (double)s->out_of_gate;
    numbers[16] = (double)s->at_rest;
    numbers[17] = (double)s->heading_known;
    numbers[18] = (double)s->lasting[0];
    numbers[19] = (double)s->lasting[1];
}

static void unpack(const double *numbers, struct mahony_f32_state *s)
{
    for (int i = 0; i < 4; i++) {
        s->world_q_body[i] = (float)numbers[i];
    }
    for (int i = 0; i < 3; i++) {
        s->gyro_bias[i] = (float)numbers[4 + i];
        s->mean_gyro[i] = (float)numbers[10 + i];
        s->mean_accel[i] = (float)numbers[13 + i];
    }
    s->since_start = (float)numbers[7];
    s->since_field = (float)numbers[8];
    s->out_of_gate = (float)numbers[9];
    s->at_rest = (float)numbers[16];
    s->heading_known = (uint8_t)numbers[17];
    s->lasting[0] = (float)numbers[18];
    s->lasting[1] = (float)numbers[19];
}

void binding_mahony_f32_start(const double *settings, double rate_hz, const double sample[9], double *state)
{
    struct mahony_f32_derived derived;
    struct mahony_f32_state own;
    struct imu_f32 first;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&first, sample, sample + 3, sample + 6);
    mahony_f32_start(&own, &derived, &first);
    pack(&own, state);
}

void binding_mahony_f32_step(const double *settings, double rate_hz, const double sample[9], double dt,
                             double *state)
{
    struct mahony_f32_derived derived;
    struct mahony_f32_state own;
    struct imu_f32 next;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&next, sample, sample + 3, sample + 6);
    unpack(state, &own);
    mahony_f32_step(&own, &derived, &next, (float)dt);
    pack(&own, state);
}

int32_t binding_mahony_f32_state_size(void)
{
    return 20;
}
