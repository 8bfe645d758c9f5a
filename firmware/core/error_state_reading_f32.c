/* Scalar readings of errors whose covariance is kept as its lower triangle, row by row. */
#include "error_state_parts_f32.h"

#define LEAST_VARIANCE 1e-12f /* of rad, rad/s, m, m/s, s or 1, squared: what is less is rounding */

SELDOM_F32
void error_state_f32_widen(float *cov, int first, int count, float variance)
{
    cov += LOWER(first, first);
    while (count-- > 0) {
        *cov += variance;
        first++;
        cov += first + 1;
    }
}

ONCE_F32
float error_state_f32_along(const struct error_state_f32_reading *reading, const float *values)
{
    float sum = 0.0f;
    int m;
    for (m = 0; m < reading->terms; m++) {
        sum += reading->weight[m] * values[reading->error[m]];
    }
    return sum;
}

/* to = from + weight times column k: as far as the diagonal it is row k, and goes down from there. */
static void add_column(float *to, const float *from, const float *cov, int n, int k, float weight)
{
    const float *p = cov + LOWER(k, 0);
    int i;
    for (i = 0; i < k; i++) {
        *to++ = *from++ + weight * *p++;
    }
    for (i = k + 1; i <= n; i++) {
        *to++ = *from++ + weight * *p;
        p += i;
    }
}

/* P H' */
OFTEN_F32
static void project(const float *cov, int n, struct error_state_f32_reading *reading)
{
    static const float none[10] = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    const float *from = none;
    int i;
    for (i = 0; i < reading->terms; i++) {
        add_column(reading->gain, from, cov, n, reading->error[i], reading->weight[i]);
        from = reading->gain;
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

#define TAKE(j) row[j] -= gain * g##j

/* Of the covariance a row's products are straight-line code that is entered at the row's length: a third of a
 * block's time is spent here. */
SELDOM_F32
float error_state_f32_read(float *values, float *row, int n, struct error_state_f32_reading *reading,
                           float found, float noise)
{
    const float innovation = found - error_state_f32_along(reading, values), *g = reading->gain;
    float inverse, g0, g1, g2, g3, g4, g5, g6, g7, g8, g9;
    int i;
    project(row, n, reading);
    inverse = 1.0f / (larger_f32(error_state_f32_along(reading, g), 0.0f) + noise);
    g0 = g[0];
    g1 = g[1];
    g2 = g[2];
    g3 = g[3];
    g4 = g[4];
    g5 = g[5];
    g6 = g[6];
    g7 = g[7];
    g8 = g[8];
    g9 = g[9];
    for (i = 0; i < n; i++) {
        const float gain = inverse * g[i];
        values[i] += gain * innovation;
        switch (i) {
        case 9:
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
            break;
        default:
            break;
        }
        row += i;
        *row = larger_f32(*row, LEAST_VARIANCE);
        row++;
    }
    return innovation;
}
