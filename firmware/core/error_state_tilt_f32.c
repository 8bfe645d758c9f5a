/* Inclination, gyro bias and bounded motion of the error-state filter, corrected once a block.
 *
 * Errors, in the order of the covariance: rotation theta in the frame of the gyro (R = exp(theta) R'), bias,
 * horizontal velocity and position.
 */
#include "error_state_parts_f32.h"

#define LEAST_TILT 1e-12f   /* rad^2 and rad^2/s^2: below this a variance is rounding */
#define LEAST_MOTION 1e-9f  /* m^2/s^2 and m^2, likewise */
#define UNKNOWN_TILT 1.0f   /* rad^2: beyond this an inclination is not known at all */

/* Velocity and position by the inclination (x, y): v' = v + push (y, -x), p' = p + dt v + half (y, -x).
 * Of two errors that both move, the covariance takes the motion of the one, and then, with it, of the other. */
static void predict_motion(float *p, float dt, float push)
{
    const float half = 0.5f * dt * push;
    float *vx = p + LOWER(6, 0), *vy = p + LOWER(7, 0), *px = p + LOWER(8, 0), *py = p + LOWER(9, 0);
    const float *row = p;
    int j;
    px[8] += dt * px[6] + half * px[1];
    py[8] += dt * py[6] + half * py[1];
    py[9] += dt * py[7] - half * py[0];
    px[6] += dt * vx[6] + half * vx[1];
    px[7] += dt * vy[6] + half * vy[1];
    py[6] += dt * vy[6] - half * vx[0];
    py[7] += dt * vy[7] - half * vy[0];
    vx[6] += push * vx[1];
    vy[6] += push * vy[1];
    vy[7] -= push * vy[0];
    for (j = 0; j < 6; j++) {
        const float x = row[0], y = row[1]; /* of row 0, whose length is 1, the second is in row 1 */
        px[j] += dt * vx[j] + half * y;
        py[j] += dt * vy[j] - half * x;
        vx[j] += push * y;
        vy[j] -= push * x;
        row += j + 1;
    }
    px[8] += dt * px[6] + half * px[1];
    py[8] += dt * px[7] - half * px[0];
    py[9] += dt * py[7] - half * py[0];
    px[6] += push * px[1];
    px[7] -= push * px[0];
    py[6] += push * py[1];
    py[7] -= push * py[0];
    vx[6] += push * vx[1];
    vy[6] -= push * vx[0];
    vy[7] -= push * vy[0];
}

/* a times column j of the three rows of the bias. */
ONCE_F32 static float by_bias(const float a[3], const float *cov, int j)
{
    return a[0] * cov[LOWER(3, 0) + j] + a[1] * cov[LOWER(4, 0) + j] + a[2] * cov[LOWER(5, 0) + j];
}

/* Rotation by the bias: theta' = theta - A b, with A = dt times the mean rotation matrix, row by row.  The
 * variance that the bias gives to the rotation about the vertical is returned, rad^2. */
static float predict_rotation(float *p, const float a[9])
{
    float *row = p + LOWER(3, 0), *to = p, about[7];
    int i, j;
    for (i = 0; i < 3; i++) {
        for (j = 0; j <= i; j++) {
            *to++ -= by_bias(a + 3 * i, p, j);
        }
    }
    for (i = 3; i < 10; i++) {
        const float x = row[3], y = i > 3 ? row[4] : p[LOWER(4, 3)], z = i > 4 ? row[5] : p[LOWER(5, i)];
        about[i - 3] = a[6] * x + a[7] * y + a[8] * z;
        row[0] -= a[0] * x + a[1] * y + a[2] * z;
        row[1] -= a[3] * x + a[4] * y + a[5] * z;
        row[2] -= about[i - 3];
        row += i + 1;
    }
    to = p;
    for (i = 0; i < 3; i++) {
        for (j = 0; j <= i; j++) {
            *to++ -= by_bias(a + 3 * j, p, i);
        }
    }
    return a[6] * about[0] + a[7] * about[1] + a[8] * about[2];
}

float error_state_f32_predict_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                   float fz)
{
    const float dt = s->sums.elapsed, inverse = 1.0f / (float)s->sums.samples;
    const float rate_squared = s->sums.rate_squared * inverse;
    const float across = dt * (d->gyro_noise + d->tilt_scale * rate_squared);
    const float about = dt * (d->gyro_noise + d->heading_scale * rate_squared);
    float *p = s->tilt_cov, *diagonal = p, matrix[9], bias;
    int i;
    for (i = 0; i < 9; i++) {
        matrix[i] = dt * inverse * s->sums.turned[i];
    }
    predict_motion(p, dt, fz * dt);
    bias = predict_rotation(p, matrix);
    for (i = 0; i < 10; i++) {
        const float more = i < 2 ? across : (i == 2 ? about : (i < 6 ? d->bias_walk * dt : 0.0f));
        *diagonal = larger_f32(*diagonal, i < 6 ? LEAST_TILT : LEAST_MOTION) + more;
        diagonal += i + 2;
    }
    return about + d->bias_memory * (dt > 0.0f ? bias / dt : 0.0f);
}

/* Lean by all that was found at once: one axis after the other would turn about the vertical as well.  The
 * rotation about the vertical is considered, not corrected. */
static void lean(float turn[4], float found[3])
{
    const struct quaternion_f32 q = load_quaternion_f32(turn);
    const float x = 0.5f * found[0], y = 0.5f * found[1];
    const float a = q.w - x * q.x - y * q.y, b = q.x + x * q.w + y * q.z;
    const float c = q.y - x * q.z + y * q.w, d = q.z + x * q.y - y * q.x;
    const float scale = 1.0f / sqrtf(a * a + b * b + c * c + d * d);
    turn[0] = a * scale;
    turn[1] = b * scale;
    turn[2] = c * scale;
    turn[3] = d * scale;
    memset(found, 0, 3 * sizeof *found);
}

/* Velocity and position by the mean force, and then f + 2 a v + a^2 p = white noise, whose level follows. */
void error_state_f32_correct_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                  const float force[2])
{
    const float dt = s->sums.elapsed, heading = s->tilt_cov[LOWER(2, 2)];
    const float share = smaller_f32(0.5f, dt * d->motion_share);
    struct error_state_f32_reading axes[2];
    float *velocity = s->tilt + 6, *position = s->tilt + 8, innovation;
    int i;
    for (i = 0; i < 2; i++) {
        struct error_state_f32_reading *axis = &axes[i];
        position[i] += dt * (velocity[i] + 0.5f * dt * force[i]);
        velocity[i] += dt * force[i];
        axis->terms = 3;
        axis->error[0] = (uint8_t)(1 - i);
        axis->error[1] = (uint8_t)(6 + i);
        axis->error[2] = (uint8_t)(8 + i);
        axis->weight[0] = i == 0 ? d->gravity : -d->gravity;
        axis->weight[1] = d->damping;
        axis->weight[2] = d->stiffness;
    }
    for (i = 0; i < 2; i++) {
        innovation = error_state_f32_read(s->tilt, s->tilt_cov, 10, &axes[i], i == 0 ? 0 : axes, -force[i],
                                          d->motion_spread * s->level / dt);
        s->level += share * (innovation * innovation * dt - s->level);
        s->level = larger_f32(s->level, d->motion_floor);
    }
    error_state_f32_take(s->tilt_cov, 10, &axes[0], &axes[1]);
    s->tilt_cov[LOWER(2, 2)] = heading;
    lean(s->turn, s->tilt);
}

/* At rest the gyro reads its bias. */
void error_state_f32_rest_bias(struct error_state_f32_state *s, const struct error_state_f32_derived *d)
{
    const float inverse = 1.0f / (float)s->sums.samples, heading = s->tilt_cov[LOWER(2, 2)];
    struct error_state_f32_reading axes[3];
    float rate[3];
    int i;
    for (i = 0; i < 3; i++) {
        axes[i].terms = 1;
        axes[i].error[0] = (uint8_t)(3 + i);
        axes[i].weight[0] = 1.0f;
        rate[i] = s->sums.rate[i] * inverse;
    }
    error_state_f32_read_three(s->tilt, s->tilt_cov, 10, axes, rate, d->rest_noise / s->sums.elapsed);
    s->tilt_cov[LOWER(2, 2)] = heading;
    lean(s->turn, s->tilt);
}

/* Add variance to the rotation, and forget velocity and position: after a start, a gap, without a force.
 * An inclination that is not known at all forgets what it has in common with the others. */
SELDOM_F32 void error_state_f32_widen_tilt(struct error_state_f32_state *s,
                                           const struct error_state_f32_derived *d, float tilt, float heading)
{
    float *p = s->tilt_cov, *row = p;
    int i, unknown;
    p[LOWER(0, 0)] += tilt;
    p[LOWER(1, 1)] += tilt;
    p[LOWER(2, 2)] += heading;
    unknown = p[LOWER(0, 0)] > UNKNOWN_TILT || p[LOWER(1, 1)] > UNKNOWN_TILT;
    for (i = 0; i < 10; i++) {
        if (i > 5) {
            memset(row, 0, (size_t)i * sizeof *row);
            row[i] = i < 8 ? d->velocity_prior : d->position_prior;
            s->tilt[i] = 0.0f;
        }
        if (unknown) {
            row[0] = i == 0 ? UNKNOWN_TILT : 0.0f;
            if (i > 0) {
                row[1] = i == 1 ? UNKNOWN_TILT : 0.0f;
            }
        }
        row += i + 1;
    }
}
