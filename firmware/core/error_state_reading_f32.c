/* Scalar readings of errors whose covariance is kept as its lower triangle, row by row. */
#include "error_state_parts_f32.h"

#define TAKE(j) row[j] -= gain_a * a##j + gain_b * b##j

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

float error_state_f32_read(float *values, const float *cov, int n, struct error_state_f32_reading *reading,
                           const struct error_state_f32_reading *before, float found, float noise)
{
    const float innovation = found - error_state_f32_along(reading, values);
    float *g = reading->gain, step;
    int i;
    memset(g, 0, sizeof reading->gain);
    for (i = 0; i < reading->terms; i++) {
        add_column(g, cov, n, reading->error[i], reading->weight[i]);
    }
    if (before) { /* what both have in common is known */
        const float share = before->inverse * error_state_f32_along(reading, before->gain);
        for (i = 0; i < n; i++) {
            g[i] -= share * before->gain[i];
        }
    }
    reading->inverse = 1.0f / (larger_f32(error_state_f32_along(reading, g), 0.0f) + noise);
    step = innovation * reading->inverse;
    for (i = 0; i < n; i++) {
        values[i] += step * g[i];
    }
    return innovation;
}

/* P <- P - a a' / A - b b' / B.  A third of a block's time is spent here: a row's products are straight-line
 * code that is entered at the row's length. */
void error_state_f32_take(float *cov, int n, const struct error_state_f32_reading *first,
                          const struct error_state_f32_reading *second)
{
    const float *a = first->gain, *b = second ? second->gain : a;
    const float per_a = first->inverse, per_b = second ? second->inverse : 0.0f;
    const float a0 = a[0], a1 = a[1], a2 = a[2], a3 = a[3], a4 = a[4];
    const float a5 = a[5], a6 = a[6], a7 = a[7], a8 = a[8], a9 = a[9];
    const float b0 = b[0], b1 = b[1], b2 = b[2], b3 = b[3], b4 = b[4];
    const float b5 = b[5], b6 = b[6], b7 = b[7], b8 = b[8], b9 = b[9];
    float *row = cov;
    int i = 0;
    do {
        const float gain_a = per_a * *a++, gain_b = per_b * *b++;
        switch (i) {
        default:
            TAKE(9); /* fall through */
        case 8:
            TAKE(8); /* fall through */
        case 7:
            TAKE(7); /* fall through */
        case 6:
            TAKE(6); /* fall through */
        case 5:
            TAKE(5); /* fall through */
        case 4:
            TAKE(4); /* fall through */
        case 3:
            TAKE(3); /* fall through */
        case 2:
            TAKE(2); /* fall through */
        case 1:
            TAKE(1); /* fall through */
        case 0:
            TAKE(0);
        }
        i++;
        row += i;
    } while (i < n);
}

void error_state_f32_read_three(float *values, float *cov, int n, struct error_state_f32_reading readings[3],
                                const float found[3], float noise)
{
    error_state_f32_read(values, cov, n, &readings[0], 0, found[0], noise);
    error_state_f32_read(values, cov, n, &readings[1], &readings[0], found[1], noise);
    error_state_f32_take(cov, n, &readings[0], &readings[1]);
    error_state_f32_read(values, cov, n, &readings[2], 0, found[2], noise);
    error_state_f32_take(cov, n, &readings[2], 0);
}
