/* The pieces of the error-state filter, as they call each other; not for users of it.
 *
 * One file each: error_state_f32.c (settings, start, the order of a step), error_state_gather_f32.c (a sample
 * into the sums), error_state_tilt_f32.c, error_state_rest_f32.c and error_state_heading_f32.c (what a block
 * corrects), error_state_reading_f32.c and error_state_turning_f32.c (covariances, quaternions),
 * error_state_report_f32.c (what is told).  Source, cost and bad input: error_state_f32.h.
 */
#ifndef FACTORLAB_ERROR_STATE_PARTS_F32_H
#define FACTORLAB_ERROR_STATE_PARTS_F32_H

#include "error_state_f32.h"
#include "turning_f32.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What does not run at every sample is made small, what runs in several places is made once. */
#if defined(__GNUC__)
#define SELDOM_F32 __attribute__((cold))
#define ONCE_F32 __attribute__((noinline))
#define OFTEN_F32 __attribute__((noinline, hot))
#else
#define SELDOM_F32
#define ONCE_F32
#define OFTEN_F32
#endif

/* Place of row i, column j <= i in a packed lower triangle. */
#define LOWER(i, j) ((i) * ((i) + 1) / 2 + (j))

/* Whether a count, or another number that is not negative, is above zero. */
INLINE_F32 int any_f32(float count)
{
    return bits_f32(count) != 0;
}

INLINE_F32 float larger_f32(float a, float b)
{
    return a > b ? a : b;
}

INLINE_F32 float smaller_f32(float a, float b)
{
    return a < b ? a : b;
}

/* A scalar reading of up to 5 of up to 10 errors, z = H x; or what moves one error by others. */
struct error_state_f32_reading {
    float weight[5];  /* the reading's unit over the error's: what is not zero in H */
    float gain[10];   /* the error's unit times the reading's: P H' */
    uint8_t error[5]; /* which errors */
    uint8_t terms;    /* 1, how many */
};

/* reading
 *   widen    add to variances
 *   along    H times values
 *   read     correct values and covariance; gives the innovation
 *   move     add H x to error k in the covariance; gives H P H' */
void error_state_f32_widen(float *cov, int first, int count, float variance);
float error_state_f32_along(const struct error_state_f32_reading *reading, const float *values);
float error_state_f32_read(float *values, float *cov, int n, struct error_state_f32_reading *reading,
                           float found, float noise);
float error_state_f32_move(float *cov, int n, int k, struct error_state_f32_reading *by);

/* turning
 *   multiply     out = p q, which may be one of both
 *   normalise    to length 1
 *   fill         all to one value
 *   rotation     matrix of a quaternion, row by row
 *   add_turned   sum += m v
 *   lean         by the quaternion (c, x, y, 0) in the frame of the gyro, normalised
 *   lean_upright by the shortest way such that a force in the frame of the gyro points up */
void error_state_f32_multiply(const float p[4], const float q[4], float out[4]);
void error_state_f32_normalise(float *values, int n);
void error_state_f32_fill(float *values, int n, float value);
void error_state_f32_rotation(const float turn[4], float matrix[9]);
void error_state_f32_add_turned(float sum[3], const float m[9], const float v[3]);
void error_state_f32_lean(float turn[4], float c, float x, float y);
void error_state_f32_lean_upright(float turn[4], const float force[3]);

void error_state_f32_half_angle(float x, float y, float half[2]);

/* gather: turn by one sample and add its force and field, in the frame of the gyro, to the sums. */
void error_state_f32_gather(struct error_state_f32_state *s, const struct imu_f32 *sample, float dt);
int error_state_f32_force_usable(const float force[3]);

/* tilt: predict, correct by the mean force and by the gyro at rest; forget velocity and position.  Predict
 * gives by how much the heading has become less sure, rad^2. */
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
