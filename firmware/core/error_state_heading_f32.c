/* The heading of the gyro's frame, from the magnetic field, without any effect on the inclination.
 *
 * Errors, in the order of the covariance: heading, reference field (north, up), residual hard iron (body),
 * delay of the magnetometer.  Fields are in lengths of the first one.
 */
#include "error_state_parts_f32.h"

#define LONGEST_UNSEEN 0.5f  /* s: disturbances farther apart than this are independent */
#define UNKNOWN_HEADING 1.0f /* rad^2: beyond this a heading is begun anew */

/* Add an angle to the heading: half of it by its tangent, whose series ends with the fifth power. */
SELDOM_F32
static void turn_heading(float half[2], float angle)
{
    const float a = 0.5f * angle, squared = a * a, c = half[0], d = half[1];
    const float tangent = a * (1.0f + squared * (1.0f / 3.0f + squared * (2.0f / 15.0f)));
    half[0] = c - tangent * d;
    half[1] = d + tangent * c;
    error_state_f32_normalise(half, 2);
}

/* Take the heading, and as long as the inclination is unsure the reference too, from a field. */
SELDOM_F32
static void begin_heading(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                          const float field[3], float tilt)
{
    const float across = field[0] * field[0] + field[1] * field[1], up = field[2] * field[2];
    float *p = s->heading_cov;
    int i;
    if (!s->heading_known) {
        s->per_length = 1.0f / sqrtf(across + up);
        error_state_f32_fill(p, LOWER(7, 0), 0.0f);
        error_state_f32_fill(s->heading, 6, 0.0f);
        s->heading[6] = d->delay;
        error_state_f32_widen(p, 3, 3, d->iron_prior);
        p[LOWER(6, 6)] = d->delay_prior;
    }
    if (!s->heading_known || tilt > d->tilt_known) {
        s->heading[1] = sqrtf(across) * s->per_length;
        s->heading[2] = field[2] * s->per_length;
        p[LOWER(1, 1)] = d->reference_prior;
        p[LOWER(2, 2)] = d->reference_prior;
    }
    s->heading_known = 1;
    p[0] = d->heading_prior + tilt * (up < 100.0f * across ? up / across : 100.0f);
    for (i = 1; i < 7; i++) {
        p += i;
        *p = 0.0f;
    }
    error_state_f32_half_angle(field[1], field[0], s->half);
    s->unseen = 0.0f;
}

/* Random walk of the heading by `variance`, of the reference and of the iron by their settings. */
SELDOM_F32
void error_state_f32_drift_heading(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                   float variance)
{
    const float dt = s->sums.elapsed;
    s->heading_cov[0] += variance;
    error_state_f32_widen(s->heading_cov, 1, 2, d->reference_walk * dt);
    error_state_f32_widen(s->heading_cov, 3, 3, d->iron_walk * dt);
    s->unseen = smaller_f32(s->unseen + dt, LONGEST_UNSEEN);
}

/* Twice the vector part of end * begin^-1 over dt: the mean rate of the block in the frame of the gyro. */
SELDOM_F32
static struct vector_f32 mean_rate(const struct error_state_f32_state *s)
{
    float by[4], scale = 2.0f / s->sums.elapsed;
    by[0] = s->begin[0];
    by[1] = -s->begin[1];
    by[2] = -s->begin[2];
    by[3] = -s->begin[3];
    error_state_f32_multiply(s->turn, by, by);
    if (by[0] < 0.0f) {
        scale = -scale;
    }
    return scaled_f32(load_vector_f32(by + 1), scale);
}

/* East, north and up of the mean field by the heading, and how they depend on the errors. */
SELDOM_F32
static void look(const struct error_state_f32_state *s, const float field[3],
                 struct error_state_f32_reading readings[3], float found[3])
{
    const float c = s->half[0] * s->half[0] - s->half[1] * s->half[1], d = 2.0f * s->half[0] * s->half[1];
    const float inverse = 1.0f / s->sums.samples, *r = s->sums.turned;
    const struct vector_f32 w = mean_rate(s), m = scaled_f32(load_vector_f32(field), s->per_length);
    const struct vector_f32 rate = vector_f32(c * w.x - d * w.y, d * w.x + c * w.y, w.z);
    const struct vector_f32 north = vector_f32(c * m.x - d * m.y, d * m.x + c * m.y, m.z);
    float slide[3];
    int i;
    store_vector_f32(found, north);
    store_vector_f32(slide, cross_f32(rate, north));
    for (i = 0; i < 3; i++) {
        readings[0].weight[1 + i] = inverse * (c * r[i] - d * r[3 + i]);
        readings[1].weight[1 + i] = inverse * (d * r[i] + c * r[3 + i]);
        readings[2].weight[1 + i] = inverse * r[6 + i];
    }
    for (i = 0; i < 3; i++) {
        static const uint8_t errors[4] = {3, 4, 5, 6};
        readings[i].gain[7] = 0.0f; /* these are loaded, and not used */
        readings[i].gain[8] = 0.0f;
        readings[i].gain[9] = 0.0f;
        readings[i].terms = 5;
        readings[i].error[0] = (uint8_t)i;
        memcpy(readings[i].error + 1, errors, sizeof errors);
        readings[i].weight[0] = i == 0 ? s->heading[1] : 1.0f;
        readings[i].weight[4] = slide[i];
    }
}

/* By how much the square of the error of strength and dip is beyond what is expected; the heading does not
 * matter for it: a wrong heading must not make the field look disturbed. */
SELDOM_F32
static float beyond(const struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                    const struct error_state_f32_reading readings[3], const float found[3], float tilt)
{
    const float north = s->heading[1], *p = s->heading_cov;
    float off[3], across;
    int i;
    for (i = 0; i < 3; i++) {
        off[i] = found[i] - error_state_f32_along(&readings[i], s->heading);
    }
    off[1] += north;
    across = sqrtf(off[0] * off[0] + off[1] * off[1]) - north;
    across = across * across + off[2] * off[2];
    return larger_f32(0.0f, across - p[LOWER(1, 1)] - p[LOWER(2, 2)] - tilt - d->field_gate);
}

SELDOM_F32
static void correct_heading(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                            const float field[3], float tilt)
{
    struct error_state_f32_reading readings[3];
    float found[3], excess, noise, *p = s->heading_cov;
    int i;
    look(s, field, readings, found);
    excess = beyond(s, d, readings, found, tilt);
    noise = d->field_noise / larger_f32(s->unseen, d->block) + 0.5f * tilt + d->field_doubt * excess;
    s->disturbed = excess > 0.0f;
    error_state_f32_widen(p, 3, 3, excess * d->iron_doubt * s->unseen);
    for (i = 0; i < 3; i++) {
        error_state_f32_read(s->heading, p, 7, &readings[i], found[i], noise);
    }
    turn_heading(s->half, s->heading[0]);
    s->heading[0] = 0.0f;
    s->unseen = 0.0f;
}

/* Whether the heading has to be begun with the next field: not known, or known less than the inclination. */
SELDOM_F32
int error_state_f32_heading_unsure(const struct error_state_f32_state *s,
                                   const struct error_state_f32_derived *d)
{
    return !s->heading_known || s->heading_cov[0] > UNKNOWN_HEADING ||
           s->tilt_cov[LOWER(0, 0)] + s->tilt_cov[LOWER(1, 1)] > d->tilt_known;
}

/* Correct the heading by the mean field of a block, or begin with it where the heading is unsure. */
SELDOM_F32
void error_state_f32_use_field(struct error_state_f32_state *s, const struct error_state_f32_derived *d)
{
    const float tilt = s->tilt_cov[LOWER(0, 0)] + s->tilt_cov[LOWER(1, 1)];
    const struct vector_f32 mean = scaled_f32(load_vector_f32(s->sums.field), 1.0f / s->sums.fields);
    float field[3];
    store_vector_f32(field, mean);
    if (!usable_f32(dot_f32(mean, mean))) {
        return;
    }
    if (error_state_f32_heading_unsure(s, d)) {
        begin_heading(s, d, field, tilt);
    } else if (s->sums.elapsed > 0.0f) {
        correct_heading(s, d, field, tilt);
    }
}
