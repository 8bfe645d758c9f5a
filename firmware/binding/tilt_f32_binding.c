/* The tilt Kalman filter in single precision, for Python: binding.h says how. */
#include "binding.h"
#include "tilt_f32.h"

static void derive(const double *p, struct tilt_f32_derived *derived)
{
    struct tilt_f32_settings s;
    s.gyro_density = (float)p[0];
    s.bias_walk = (float)p[1];
    s.tilt_sigma = (float)p[2];
    s.heading_sigma = (float)p[3];
    s.nis_gate = (float)p[4];
    s.bias_sigma = (float)p[5];
    tilt_f32_derive(&s, derived);
}

void binding_tilt_f32_run(const double *settings, const struct recording *in, const struct answer *out)
{
    struct tilt_f32_derived derived;
    struct tilt_f32_state state;
    struct imu_f32 sample;
    derive(settings, &derived);
    load_row_f32(&sample, in, 0);
    tilt_f32_start(&state, &derived, &sample);
    for (int64_t k = 0; k < in->count; k++) {
        float numbers[4];
        load_row_f32(&sample, in, k);
        tilt_f32_step(&state, &derived, &sample, (float)interval(in, k));
        tilt_f32_attitude(&state, numbers);
        store_quaternion(out->world_q_body, k, numbers);
        tilt_f32_gyro_bias(&state, numbers);
        store_row(out->bias, k, 3, numbers);
    }
}

/* Numbers in the order of sequential/attitude/tilt_kernel.py; the last three, rates, are not kept in C. */
static void pack(const struct tilt_f32_state *s, double *numbers)
{
    for (int i = 0; i < 3; i++) {
        numbers[i] = (double)s->angle[i];
        numbers[3 + i] = (double)s->bias[i];
        numbers[6 + i] = (double)s->angle_variance[i];
        numbers[9 + i] = (double)s->covariance[i];
        numbers[12 + i] = (double)s->bias_variance[i];
        numbers[16 + i] = 0.0;
    }
    numbers[15] = (double)s->heading_known;
}

static void unpack(const double *numbers, struct tilt_f32_state *s)
{
    for (int i = 0; i < 3; i++) {
        s->angle[i] = (float)numbers[i];
        s->bias[i] = (float)numbers[3 + i];
        s->angle_variance[i] = (float)numbers[6 + i];
        s->covariance[i] = (float)numbers[9 + i];
        s->bias_variance[i] = (float)numbers[12 + i];
    }
    s->heading_known = (uint8_t)numbers[15];
}

int32_t binding_tilt_f32_state_size(void)
{
    return 19;
}

void binding_tilt_f32_start(const double *settings, double rate_hz, const double sample[9], double *state)
{
    struct tilt_f32_derived derived;
    struct tilt_f32_state own;
    struct imu_f32 first;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&first, sample, sample + 3, sample + 6);
    tilt_f32_start(&own, &derived, &first);
    pack(&own, state);
}

void binding_tilt_f32_step(const double *settings, double rate_hz, const double sample[9], double dt, double *state)
{
    struct tilt_f32_derived derived;
    struct tilt_f32_state own;
    struct imu_f32 next;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&next, sample, sample + 3, sample + 6);
    unpack(state, &own);
    tilt_f32_step(&own, &derived, &next, (float)dt);
    pack(&own, state);
}
