/* What the error-state filter tells: both attitudes, and how well they and the bias are known. */
#include "error_state_parts_f32.h"

/* Rate without bias; zero where the gyro was not read. */
INLINE_F32 struct vector_f32 present_rate(const struct error_state_f32_state *s)
{
    const struct vector_f32 bias = load_vector_f32(s->tilt + 3);
    const struct vector_f32 rate = minus_f32(load_vector_f32(s->last_rate), bias, 1.0f);
    return s->unread ? vector_f32(0.0f, 0.0f, 0.0f) : rate;
}

/* The attitude of the gyro's frame at the time of the sample, whose reading is `latency` old, turned about
 * the vertical by the angle of which cosine and sine of the half are given; of both signs that of w >= 0. */
ONCE_F32
static void ahead(const struct error_state_f32_state *s, float c, float d, float out[4])
{
    float by[4], about[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    about[0] = c;
    about[3] = d;
    by[0] = 1.0f;
    store_vector_f32(by + 1, scaled_f32(present_rate(s), 0.5f * s->latency));
    error_state_f32_multiply(s->turn, by, by);
    error_state_f32_multiply(about, by, out);
    error_state_f32_normalise(out, 4);
    if (out[0] < 0.0f) {
        int i;
        for (i = 0; i < 4; i++) {
            out[i] = -out[i];
        }
    }
}

void error_state_f32_heading_free(const struct error_state_f32_state *s, float frame_q_body[4])
{
    ahead(s, 1.0f, 0.0f, frame_q_body);
}

void error_state_f32_attitude(const struct error_state_f32_state *s, float world_q_body[4])
{
    ahead(s, s->half[0], s->half[1], world_q_body);
}

/* R' P R in the body frame for P in the frame of the gyro, and the rotation within the spread of latency. */
static void into_body(const struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                      const float frame[6], float cov[9])
{
    float matrix[9], rate[3];
    const float *x = matrix, *y = matrix + 3, *z = matrix + 6;
    int i, j;
    error_state_f32_rotation(s->turn, matrix);
    store_vector_f32(rate, present_rate(s));
    for (j = 0; j < 3; j++) {
        const float u = frame[0] * x[j] + frame[1] * y[j] + frame[3] * z[j];
        const float v = frame[1] * x[j] + frame[2] * y[j] + frame[4] * z[j];
        const float w = frame[3] * x[j] + frame[4] * y[j] + frame[5] * z[j];
        for (i = j; i < 3; i++) {
            cov[3 * i + j] = x[i] * u + y[i] * v + z[i] * w + d->latency_prior * rate[i] * rate[j];
            cov[3 * j + i] = cov[3 * i + j];
        }
    }
}

void error_state_f32_covariance_6d(const struct error_state_f32_state *s,
                                   const struct error_state_f32_derived *d, float cov[9])
{
    const float *p = s->tilt_cov;
    const float frame[6] = {p[0] + d->tilt_floor, p[1], p[2] + d->tilt_floor, p[3], p[4], p[5]};
    into_body(s, d, frame, cov);
}

void error_state_f32_covariance(const struct error_state_f32_state *s,
                                const struct error_state_f32_derived *d, float cov[9])
{
    if (s->heading_known) {
        const float *p = s->tilt_cov;
        const float iron = d->heading_floor / larger_f32(1e-6f, s->heading[1] * s->heading[1]);
        const float heading = s->heading_cov[0] + smaller_f32(1.0f, iron);
        const float frame[6] = {p[0] + d->tilt_floor, p[1], p[2] + d->tilt_floor, 0.0f, 0.0f, heading};
        into_body(s, d, frame, cov);
    } else {
        error_state_f32_covariance_6d(s, d, cov);
    }
}

void error_state_f32_bias(const struct error_state_f32_state *s, float bias[3])
{
    memcpy(bias, s->tilt + 3, 3 * sizeof *bias);
}

void error_state_f32_bias_covariance(const struct error_state_f32_state *s, float cov[9])
{
    const float *p = s->tilt_cov;
    int i, j;
    for (i = 0; i < 3; i++) {
        for (j = 0; j <= i; j++) {
            cov[3 * i + j] = p[LOWER(3 + i, 3 + j)];
            cov[3 * j + i] = p[LOWER(3 + i, 3 + j)];
        }
    }
}
