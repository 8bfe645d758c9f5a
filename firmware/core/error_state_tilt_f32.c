/* Inclination, gyro bias and bounded motion of the error-state filter, corrected once a block.
 *
 * Errors, in the order of the covariance: rotation theta in the frame of the gyro (R = exp(theta) R'), bias,
 * horizontal velocity and position.
 */
#include "error_state_parts_f32.h"

#define UNKNOWN_TILT 1.0f /* rad^2: beyond this an inclination is not known at all */

/* How the three errors of an axis in the horizontal plane act on what it accelerates by: x leans about y. */
ONCE_F32 SELDOM_F32
static void set_axis(struct error_state_f32_reading *axis, int i, float tilt, float velocity, float position)
{
    axis->terms = 3;
    axis->error[0] = (uint8_t)(1 - i);
    axis->error[1] = (uint8_t)(6 + i);
    axis->error[2] = (uint8_t)(8 + i);
    axis->weight[0] = i == 0 ? tilt : -tilt;
    axis->weight[1] = velocity;
    axis->weight[2] = position;
}

/* Covariance after p' = p + dt v + dt push / 2 (y, -x), v' = v + push (y, -x), and then
 * theta' = theta - dt R b, with R the mean rotation matrix.  Gives the variance that the bias adds to the
 * rotation about up, rad^2. */
SELDOM_F32
static float predict(struct error_state_f32_state *s, float push)
{
    const float dt = s->sums.elapsed, turned = -dt / s->sums.samples;
    struct error_state_f32_reading moved;
    float about = 0.0f;
    int i, j;
    for (i = 0; i < 4; i++) { /* both positions, then both velocities */
        set_axis(&moved, i & 1, i < 2 ? 0.5f * dt * push : push, dt, 0.0f);
        moved.terms = i < 2 ? 2 : 1;
        error_state_f32_move(s->tilt_cov, 10, i < 2 ? 8 + i : 4 + i, &moved);
    }
    moved.terms = 3;
    for (i = 0; i < 3; i++) {
        for (j = 0; j < 3; j++) {
            moved.error[j] = (uint8_t)(3 + j);
            moved.weight[j] = turned * s->sums.turned[3 * i + j];
        }
        about = error_state_f32_move(s->tilt_cov, 10, i, &moved);
    }
    return about;
}

SELDOM_F32
float error_state_f32_predict_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                   float fz)
{
    const float dt = s->sums.elapsed, rate_squared = s->sums.rate_squared / s->sums.samples;
    const float across = dt * (d->gyro_noise + d->tilt_scale * rate_squared);
    const float about = dt * (d->gyro_noise + d->heading_scale * rate_squared);
    const float by_bias = predict(s, fz * dt);
    error_state_f32_widen(s->tilt_cov, 0, 2, across);
    error_state_f32_widen(s->tilt_cov, 2, 1, about);
    error_state_f32_widen(s->tilt_cov, 3, 3, d->bias_walk * dt);
    return about + (dt > 0.0f ? d->bias_memory * by_bias / dt : 0.0f);
}

/* One reading of inclination, bias, velocity and position.  The rotation about the vertical is considered,
 * not corrected: it shares in what is known, and keeps its variance. */
ONCE_F32 SELDOM_F32
static float read(struct error_state_f32_state *s, struct error_state_f32_reading *reading, float found,
                  float noise)
{
    const float about = s->tilt_cov[LOWER(2, 2)];
    const float innovation = error_state_f32_read(s->tilt, s->tilt_cov, 10, reading, found, noise);
    s->tilt_cov[LOWER(2, 2)] = about;
    return innovation;
}

/* Lean by all that was found at once: one axis after the other would turn about the vertical as well. */
ONCE_F32 SELDOM_F32
static void lean(struct error_state_f32_state *s)
{
    error_state_f32_lean(s->turn, 1.0f, 0.5f * s->tilt[0], 0.5f * s->tilt[1]);
    error_state_f32_fill(s->tilt, 3, 0.0f);
}

/* Velocity and position by the mean force, and then f + 2 a v + a^2 p = white noise, whose level follows. */
SELDOM_F32
void error_state_f32_correct_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                  const float force[2])
{
    const float dt = s->sums.elapsed, share = smaller_f32(0.5f, dt * d->motion_share);
    struct error_state_f32_reading axis;
    float *velocity = s->tilt + 6, *position = s->tilt + 8;
    int i;
    for (i = 0; i < 2; i++) {
        position[i] += dt * (velocity[i] + 0.5f * dt * force[i]);
        velocity[i] += dt * force[i];
    }
    for (i = 0; i < 2; i++) {
        float innovation;
        set_axis(&axis, i, d->gravity, d->damping, d->stiffness);
        innovation = read(s, &axis, -force[i], d->motion_spread * s->level / dt);
        s->level += share * (innovation * innovation * dt - s->level);
        s->level = larger_f32(s->level, d->motion_floor);
    }
    lean(s);
}

/* At rest the gyro reads its bias. */
SELDOM_F32
void error_state_f32_rest_bias(struct error_state_f32_state *s, const struct error_state_f32_derived *d)
{
    struct error_state_f32_reading axis;
    int i;
    axis.terms = 1;
    axis.weight[0] = 1.0f;
    for (i = 0; i < 3; i++) {
        axis.error[0] = (uint8_t)(3 + i);
        read(s, &axis, s->sums.rate[i] / s->sums.samples, d->rest_noise / s->sums.elapsed);
    }
    lean(s);
}

/* Add variance to the rotation, and forget velocity and position: after a start, a gap, without a force.
 * An inclination that is not known at all forgets what it has in common with the others. */
SELDOM_F32
void error_state_f32_widen_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                float tilt, float heading)
{
    float *p = s->tilt_cov;
    error_state_f32_fill(p + LOWER(6, 0), 34, 0.0f);
    error_state_f32_fill(s->tilt + 6, 4, 0.0f);
    p[LOWER(6, 6)] = d->velocity_prior;
    p[LOWER(7, 7)] = d->velocity_prior;
    p[LOWER(8, 8)] = d->position_prior;
    p[LOWER(9, 9)] = d->position_prior;
    error_state_f32_widen(p, 0, 2, tilt);
    p[LOWER(2, 2)] += heading;
    if (p[LOWER(0, 0)] > UNKNOWN_TILT || p[LOWER(1, 1)] > UNKNOWN_TILT) {
        int i;
        for (i = 1; i < 6; i++) {
            error_state_f32_fill(p + LOWER(i, 0), 2, 0.0f);
        }
        p[LOWER(0, 0)] = UNKNOWN_TILT;
        p[LOWER(1, 1)] = UNKNOWN_TILT;
    }
}
