/* The complementary filter in single precision, for Python: binding.h says how. */
#include "binding.h"
#include "complementary_f32.h"

static void derive(const double *p, struct complementary_f32_derived *derived)
{
    struct complementary_f32_settings s;
    s.time_constant = (float)p[0];
    s.heading_time_constant = (float)p[1];
    complementary_f32_derive(&s, derived);
}

void binding_complementary_f32_run(const double *settings, const struct recording *in, const struct answer *out)
{
    struct complementary_f32_derived derived;
    struct complementary_f32_state state;
    struct imu_f32 sample;
    derive(settings, &derived);
    load_row_f32(&sample, in, 0);
    complementary_f32_start(&state, &derived, &sample);
    for (int64_t k = 0; k < in->count; k++) {
        load_row_f32(&sample, in, k);
        complementary_f32_step(&state, &derived, &sample, (float)interval(in, k));
        store_quaternion(out->world_q_body, k, state.world_q_body);
    }
}

/* Numbers in the order of sequential/attitude/complementary_kernel.py. */
static void pack(const struct complementary_f32_state *s, double *numbers)
{
    store_row(numbers, 0, 4, s->world_q_body);
    numbers[4] = (double)s->since_field;
    numbers[5] = (double)s->heading_known;
}

static void unpack(const double *numbers, struct complementary_f32_state *s)
{
    for (int i = 0; i < 4; i++) {
        s->world_q_body[i] = (float)numbers[i];
    }
    s->since_field = (float)numbers[4];
    s->heading_known = (uint8_t)numbers[5];
}

int32_t binding_complementary_f32_state_size(void)
{
    return 6;
}

void binding_complementary_f32_start(const double *settings, double rate_hz, const double sample[9], double *state)
{
    struct complementary_f32_derived derived;
    struct complementary_f32_state own;
    struct imu_f32 first;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&first, sample, sample + 3, sample + 6);
    complementary_f32_start(&own, &derived, &first);
    pack(&own, state);
}

void binding_complementary_f32_step(const double *settings, double rate_hz, const double sample[9], double dt,
                                    double *state)
{
    struct complementary_f32_derived derived;
    struct complementary_f32_state own;
    struct imu_f32 next;
    (void)rate_hz;
    derive(settings, &derived);
    load_f32(&next, sample, sample + 3, sample + 6);
    unpack(state, &own);
    complementary_f32_step(&own, &derived, &next, (float)dt);
    pack(&own, state);
}
