/* The pieces of the error-state filter, as they call each other; not for users of it.
 *
 * One file each: error_state_f32.c (settings, start, the order of a step), error_state_gather_f32.c (a sample
 * into the sums), error_state_tilt_f32.c, error_state_rest_f32.c and error_state_heading_f32.c (what a block
 * corrects), error_state_report_f32.c (what is told).  See error_state_f32.h.
 */
#ifndef FACTORLAB_ERROR_STATE_PARTS_F32_H
#define FACTORLAB_ERROR_STATE_PARTS_F32_H

#include "error_state_f32.h"
#include "turning_f32.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What hardly ever runs is made small, what runs in several places is made once. */
#if defined(__GNUC__)
#define SELDOM_F32 __attribute__((cold, noinline))
#define ONCE_F32 __attribute__((noinline))
#else
#define SELDOM_F32
#define ONCE_F32
#endif

/* Place of row i, column j <= i in a packed lower triangle. */
#define LOWER(i, j) ((i) * ((i) + 1) / 2 + (j))

INLINE_F32 float larger_f32(float a, float b)
{
    return a > b ? a : b;
}

INLINE_F32 float smaller_f32(float a, float b)
{
    return a < b ? a : b;
}

/* Rows of a rotation matrix. */
struct rotation_f32 {
    struct vector_f32 x, y, z; /* 1 */
};

INLINE_F32 struct rotation_f32 rotation_f32(struct quaternion_f32 q)
{
    const float w2 = 2.0f * q.w, x2 = 2.0f * q.x, y2 = 2.0f * q.y, z2 = 2.0f * q.z;
    const float xx = x2 * q.x, yy = y2 * q.y, zz = z2 * q.z, xy = x2 * q.y, xz = x2 * q.z, yz = y2 * q.z;
    const float wx = w2 * q.x, wy = w2 * q.y, wz = w2 * q.z;
    struct rotation_f32 r;
    r.x = vector_f32(1.0f - (yy + zz), xy - wz, xz + wy);
    r.y = vector_f32(xy + wz, 1.0f - (xx + zz), yz - wx);
    r.z = vector_f32(xz - wy, yz + wx, 1.0f - (xx + yy));
    return r;
}

INLINE_F32 struct vector_f32 rotated_f32(const struct rotation_f32 *r, struct vector_f32 v)
{
    return vector_f32(dot_f32(r->x, v), dot_f32(r->y, v), dot_f32(r->z, v));
}

/* A scalar reading of up to 5 of up to 10 errors, z = H x. */
struct error_state_f32_reading {
    float weight[5];  /* the reading's unit over the error's: what is not zero in H */
    float gain[10];   /* the error's unit times the reading's: P H' */
    float inverse;    /* 1 over the reading's unit squared: 1 / (H P H' + noise) */
    uint8_t error[5]; /* which errors */
    uint8_t terms;    /* 1, how many */
};

/* reading: H times values; read puts the correction into the values (and gives the innovation), with P as before
 * another reading whose share is left out; take then takes what one or two readings know from P. */
float error_state_f32_along(const struct error_state_f32_reading *reading, const float *values);
float error_state_f32_read(float *values, const float *cov, int n, struct error_state_f32_reading *reading,
                           const struct error_state_f32_reading *before, float found, float noise);
void error_state_f32_take(float *cov, int n, const struct error_state_f32_reading *first,
                          const struct error_state_f32_reading *second);
void error_state_f32_read_three(float *values, float *cov, int n, struct error_state_f32_reading readings[3],
                                const float found[3], float noise);

/* start: level by the accelerometer; cosine and sine of half of the angle of (x, y). */
void error_state_f32_half_angle(float x, float y, float half[2]);

/* gather: turn by one sample and add its force and field, in the frame of the gyro, to the sums. */
void error_state_f32_gather(struct error_state_f32_state *s, const struct imu_f32 *sample, float dt);
int error_state_f32_force_usable(const float force[3]);

/* tilt: predict, correct by the mean force and by the gyro at rest; forget velocity and position.  Predict gives
 * by how much the heading has become less sure, rad^2. */
float error_state_f32_predict_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                   float fz);
void error_state_f32_correct_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                  const float force[2]);
void error_state_f32_rest_bias(struct error_state_f32_state *s, const struct error_state_f32_derived *d);
void error_state_f32_widen_tilt(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                float tilt, float heading);

/* rest: whether nothing moves; whether the mean force points far from up, and then level by it. */
void error_state_f32_watch_rest(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                float per_force);
int error_state_f32_overturned(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                               float per_force);
void error_state_f32_lean_upright(float turn[4], struct vector_f32 force);

/* heading: drift over a block, and the correction by the mean field. */
void error_state_f32_drift_heading(struct error_state_f32_state *s, const struct error_state_f32_derived *d,
                                   float variance);
int error_state_f32_heading_unsure(const struct error_state_f32_state *s,
                                   const struct error_state_f32_derived *d);
void error_state_f32_use_field(struct error_state_f32_state *s, const struct error_state_f32_derived *d);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_ERROR_STATE_PARTS_F32_H */
