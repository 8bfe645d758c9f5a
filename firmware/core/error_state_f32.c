/* Settings and start of the error-state filter, and the order of what a step does. */
#include "error_state_f32.h"

#include "error_state_parts_f32.h"

#define DEGREE 0.017453292519943295f /* rad */
#define FASTEST 1000.0f              /* rad/s: no gyro reads more */
#define SETTINGS 39                  /* how many there are, ... */
#define FIRST_SQUARED 16             /* ... of which these and the following are squared */

typedef char as_many_floats[sizeof(struct error_state_f32_settings) == SETTINGS * sizeof(float) ? 1 : -1];

SELDOM_F32
void error_state_f32_defaults(struct error_state_f32_settings *settings)
{
    static const struct error_state_f32_settings usual = {
        .block = 0.05f,
        .gap = 0.25f,
        .motion_bandwidth = 1.5f,
        .motion_spread = 0.85f,
        .motion_floor = 1e-4f,
        .motion_time = 1.0f,
        .start_motion = 1.0f,
        .gravity = 9.80665f,
        .rest_rate = 2.0f * DEGREE,
        .rest_time = 1.0f,
        .rest_filter = 0.5f,
        .field_doubt = 100.0f,
        .bias_memory = 10.0f,
        .iron_doubt = 0.1f,
        .delay = 0.01f,
        .latency = 0.004f,
        .gyro_noise = 0.01f * DEGREE,
        .tilt_scale = 0.0008f,
        .heading_scale = 0.004f,
        .bias_walk = 0.0005f * DEGREE,
        .bias_sigma = 0.5f * DEGREE,
        .velocity_sigma = 0.5f,
        .position_sigma = 0.3f,
        .rest_rate_change = 2.0f * DEGREE,
        .rest_force_change = 0.3f,
        .rest_noise = 0.03f * DEGREE,
        .field_noise = 0.05f,
        .field_gate = 0.06f,
        .iron_sigma = 0.005f,
        .iron_walk = 0.0005f,
        .reference_sigma = 0.1f,
        .reference_walk = 0.0005f,
        .delay_sigma = 0.005f,
        .latency_sigma = 0.001f,
        .tilt_floor = 0.2f * DEGREE,
        .heading_floor = 0.02f,
        .start_tilt_sigma = 0.2f,
        .start_heading_sigma = 0.3f,
        .start_known = 0.1f,
    };
    *settings = usual;
}

SELDOM_F32
void error_state_f32_derive(const struct error_state_f32_settings *settings,
                            struct error_state_f32_derived *derived)
{
    float values[SETTINGS];
    int i;
    memcpy(values, settings, sizeof values);
    for (i = FIRST_SQUARED; i < SETTINGS; i++) {
        values[i] *= values[i];
    }
    memcpy(derived, values, sizeof values);
    derived->block *= 1.0f - 1e-5f;
    derived->damping = 2.0f * settings->motion_bandwidth;
    derived->stiffness = settings->motion_bandwidth * settings->motion_bandwidth;
    derived->motion_share = 0.5f / settings->motion_time;
    derived->rest_share = 1.0f / settings->rest_filter;
    derived->bias_memory *= 2.0f;
}

/* The attitude of yaw 0 in which the specific force points up. */
SELDOM_F32
static void level(float turn[4], const float accel[3])
{
    float roll[2], pitch[2];
    error_state_f32_half_angle(accel[2], accel[1], roll);
    error_state_f32_half_angle(sqrtf(accel[1] * accel[1] + accel[2] * accel[2]), -accel[0], pitch);
    turn[0] = roll[0] * pitch[0];
    turn[1] = roll[1] * pitch[0];
    turn[2] = roll[0] * pitch[1];
    turn[3] = -roll[1] * pitch[1];
}

SELDOM_F32
static void open_block(struct error_state_f32_state *s)
{
    error_state_f32_fill((float *)&s->sums, (int)(sizeof s->sums / sizeof(float)), 0.0f);
    memcpy(s->begin, s->turn, sizeof s->begin);
    s->closing = 0;
}

SELDOM_F32
void error_state_f32_start(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                           const struct imu_f32 *first)
{
    memset(s, 0, sizeof *s);
    s->started = (uint8_t)error_state_f32_force_usable(first->accel);
    s->turn[0] = 1.0f;
    if (s->started) {
        level(s->turn, first->accel);
    }
    s->half[0] = 1.0f;
    s->latency = d->latency;
    s->level = d->level_prior;
    s->tilt_cov[LOWER(3, 3)] = d->bias_prior;
    s->tilt_cov[LOWER(4, 4)] = d->bias_prior;
    s->tilt_cov[LOWER(5, 5)] = d->bias_prior;
    error_state_f32_widen_tilt(s, d, d->tilt_prior, 0.0f);
    open_block(s);
}

/* The rest of what a block corrects, with the next sample: so that none of both takes too long. */
SELDOM_F32
static void finish_block(struct error_state_f32_state *s, const struct error_state_f32_derived *d)
{
    if (s->resting) {
        error_state_f32_rest_bias(s, d);
    }
    if (any_f32(s->sums.fields)) {
        error_state_f32_use_field(s, d);
    }
    open_block(s);
}

/* Predict with the sums of a block and correct the inclination. */
SELDOM_F32
static void close_block(struct error_state_f32_state *s, const struct error_state_f32_derived *d)
{
    const float per_force = any_f32(s->sums.forces) ? 1.0f / s->sums.forces : 1.0f;
    const struct vector_f32 mean = scaled_f32(load_vector_f32(s->sums.force), per_force);
    const float force[2] = {mean.x, mean.y}, drift = error_state_f32_predict_tilt(s, d, mean.z);
    error_state_f32_watch_rest(s, d, per_force);
    if (!any_f32(s->sums.forces)) {
        error_state_f32_widen_tilt(s, d, 0.0f, 0.0f);
    } else if (s->sums.elapsed > 0.0f && !error_state_f32_overturned(s, d, per_force)) {
        error_state_f32_correct_tilt(s, d, force);
    }
    if (s->heading_known) {
        error_state_f32_drift_heading(s, d, drift);
    }
    s->closing = 1;
    if (any_f32(s->sums.fields) && error_state_f32_heading_unsure(s, d)) {
        finish_block(s, d);
    }
}

/* Nothing was read for a while: it may have turned by half a radian a second, any way. */
SELDOM_F32
static void jump(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                 const float accel[3], float dt)
{
    const float turned = smaller_f32(0.25f * dt * dt, 10.0f);
    if (any_f32(s->sums.samples)) {
        close_block(s, d);
    }
    if (s->closing) {
        finish_block(s, d);
    }
    s->heading_cov[0] += turned;
    s->age = 0.0f;
    error_state_f32_widen_tilt(s, d, smaller_f32(turned, d->tilt_prior), turned);
    if (turned > d->tilt_prior && error_state_f32_force_usable(accel)) {
        float matrix[9], force[3] = {0.0f, 0.0f, 0.0f};
        error_state_f32_rotation(s->turn, matrix);
        error_state_f32_add_turned(force, matrix, accel);
        error_state_f32_lean_upright(s->turn, force);
    }
    s->level = d->level_prior;
    s->still = 0.0f;
    s->resting = 0;
    open_block(s);
}

void error_state_f32_step(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                          const struct imu_f32 *sample, float dt)
{
    const struct vector_f32 rate = load_vector_f32(sample->gyro);
    float since = (dt > 0.0f ? dt : 0.0f) + s->pending;
    if (s->closing) {
        finish_block(s, d);
    }
    s->unread = !(dot_f32(rate, rate) < FASTEST * FASTEST);
    if (s->unread) {
        s->pending = since;
        return;
    }
    s->pending = 0.0f;
    if (!s->started) {
        error_state_f32_start(s, d, sample);
        since = 0.0f;
    }
    if (since > d->gap) {
        jump(s, d, sample->accel, since);
        since = 0.0f;
    }
    error_state_f32_gather(s, sample, since);
    if (!s->heading_known && any_f32(s->sums.fields)) {
        error_state_f32_use_field(s, d);
    }
    if (s->sums.elapsed >= d->block) {
        close_block(s, d);
    }
}
