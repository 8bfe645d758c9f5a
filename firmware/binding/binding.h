/* What Python calls: every filter over a whole recording, and one sample at a time.
 *
 * For a filter M (mahony_f32, mahony_q ...) there are these functions, all of the same shape:
 *
 *     void binding_M_run(const double *settings, const struct recording *, const struct answer *);
 *     void binding_M_start(const double *settings, double rate_hz, const double sample[9], double *state);
 *     void binding_M_step(const double *settings, double rate_hz, const double sample[9], double dt, double *state);
 *     int32_t binding_M_state_size(void);    // of `state`, doubles
 *
 * `settings` holds what the FIELDS of the Python class name, in their order.  `sample` is gyro (rad/s), accelerometer
 * (m/s^2), magnetometer (uT, NaN: none).  `state` begins with the quaternion.  For mahony_f32, tilt_f32 and
 * complementary_f32 it holds numbers in the layout of the Python filter of that name, so that both can step
 * from an equal state; for the others the struct as it lies in memory follows.  Arrays are contiguous.
 *
 * The fixed-point filters count whole periods of 1 / rate_hz.  A sample that comes dt after the one before is
 * given the nearest number of periods n, and its gyro is scaled by dt * rate_hz / n: the angle turned since the
 * last sample is right for any stamps, as a board's own clock makes it.
 */
#ifndef FACTORLAB_BINDING_H
#define FACTORLAB_BINDING_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "imu.h"

/* A recording, as Python holds it. */
struct recording {
    int64_t count;       /* samples */
    const int64_t *t;    /* ns */
    const double *gyro;  /* rad/s, three a sample */
    const double *accel; /* m/s^2, likewise */
    const double *mag;   /* uT, likewise; NULL: no magnetometer */
    double rate_hz;      /* Hz, nominal; only the fixed-point filters look at it */
};

/* What a filter found, as Python keeps it; NULL where it is not asked for. */
struct answer {
    double *world_q_body; /* 1, w x y z a sample, w >= 0 */
    double *bias;         /* rad/s, three a sample */
    uint8_t *rest;        /* whether the sensor is held to be at rest */
    uint8_t *disturbed;   /* whether the field is not trusted */
    double *heading_free; /* 1, the answer without magnetometer, w x y z a sample */
    double *cov;          /* rad^2, (3, 3) a sample, row by row */
    double *cov_6d;       /* rad^2, the same without magnetometer */
    double *bias_cov;     /* rad^2/s^2, likewise */
};

static inline void load_f32(struct imu_f32 *sample, const double *gyro, const double *accel, const double *mag)
{
    for (int i = 0; i < 3; i++) {
        sample->gyro[i] = (float)gyro[i];
        sample->accel[i] = (float)accel[i];
        sample->mag[i] = mag == NULL ? NAN : (float)mag[i];
    }
}

static inline void load_row_f32(struct imu_f32 *sample, const struct recording *in, int64_t k)
{
    load_f32(sample, in->gyro + 3 * k, in->accel + 3 * k, in->mag == NULL ? NULL : in->mag + 3 * k);
}

static inline double interval(const struct recording *in, int64_t k)
{
    return k == 0 ? 0.0 : (double)(in->t[k] - in->t[k - 1]) * 1e-9;
}

/* The one of both signs whose w is not negative. */
static inline void store_quaternion(double *path, int64_t k, const float q[4])
{
    const double sign = copysign(1.0, (double)q[0]);
    for (int i = 0; i < 4; i++) {
        path[4 * k + i] = sign * (double)q[i];
    }
}

static inline void store_row(double *rows, int64_t k, int width, const float *values)
{
    for (int i = 0; i < width; i++) {
        rows[width * k + i] = (double)values[i];
    }
}

#endif /* FACTORLAB_BINDING_H */
