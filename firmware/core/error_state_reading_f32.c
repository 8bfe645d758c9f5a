/* Scalar readings of errors whose covariance is kept as its lower triangle, row by row. */
#include "error_state_parts_f32.h"

#define LEAST_VARIANCE 1e-12f /* of rad, rad/s, m, m/s, s or 1, squared: what is less is rounding */

float error_state_f32_along(const struct error_state_f32_reading *reading, const float *values)
{
    float sum = 0.0f;
    int m;
    for (m = 0; m < reading->terms; m++) {
        sum += reading->weight[m] * values[reading->error[m]];
    }
    return sum;
}

/* to += weight times column k: as far as the diagonal it is row k, and goes down from there. */
static void add_column(float *to, const float *cov, int n, int k, float weight)
{
    const float *p = cov + LOWER(k, 0);
    int i;
    for (i = 0; i < k; i++) {
        *to++ += weight * *p++;
    }
    for (i = k + 1; i <= n; i++) {
        *to++ += weight * *p;
        p += i;
    }
}

/* P H' */
ONCE_F32
static void project(const float *cov, int n, struct error_state_f32_reading *reading)
{
    int i;
    error_state_f32_fill(reading->gain, n, 0.0f);
    for (i = 0; i < reading->terms; i++) {
        add_column(reading->gain, cov, n, reading->error[i], reading->weight[i]);
    }
}

SELDOM_F32
float error_state_f32_move(float *cov, int n, int k, struct error_state_f32_reading *by)
{
    float *row = cov + LOWER(k, 0), *g = by->gain, added;
    int i;
    project(cov, n, by);
    added = error_state_f32_along(by, g);
    g[k] = 2.0f * g[k] + added;
    for (i = 0; i < k; i++) {
        *row++ += *g++;
    }
    for (i = k + 1; i <= n; i++) {
        *row += *g++;
        row += i;
    }
    return added;
}

float error_state_f32_read(float *values, float *cov, int n, struct error_state_f32_reading *reading,
                           float found, float noise)
{
    const float innovation = found - error_state_f32_along(reading, values), *g = reading->gain;
    float inverse;
    int i, j;
    project(cov, n, reading);
    inverse = 1.0f / (larger_f32(error_state_f32_along(reading, g), 0.0f) + noise);
    for (i = 0; i < n; i++) {
        const float gain = inverse * g[i];
        values[i] += gain * innovation;
        for (j = 0; j <= i; j++) {
            *cov++ -= gain * g[j];
        }
        cov[-1] = larger_f32(cov[-1], LEAST_VARIANCE);
    }
    return innovation;
}
