/* Readings in SI become the samples of the fixed-point filters: quantised, saturated, counted in periods. */
#ifndef FACTORLAB_FIXED_BINDING_H
#define FACTORLAB_FIXED_BINDING_H

#include "binding.h"

/* A sample, and how many periods it came after the one before: 1 normally, 0 for the first. */
struct fixed_sample {
    struct imu_q imu;
    uint8_t periods;
    uint8_t usable; /* whether the gyro read a number; a board's always does */
};

static inline int32_t quantised(double value, double unit, int32_t limit)
{
    const double scaled = nearbyint(value * unit);
    if (!(scaled < (double)limit)) {
        return isnan(scaled) ? 0 : limit;
    }
    return scaled < -(double)limit ? -limit : (int32_t)scaled;
}

/* All zero stands for no reading, as on a board. */
static inline void quantise_q8(int16_t out[3], const double *values)
{
    for (int i = 0; i < 3; i++) {
        const int usable = values != NULL && !isnan(values[0] + values[1] + values[2]);
        out[i] = usable ? (int16_t)quantised(values[i], 256.0, INT16_MAX) : 0;
    }
}

static inline struct fixed_sample fixed_sample(const double *gyro, const double *accel, const double *mag, double dt,
                                               double rate_hz)
{
    struct fixed_sample made;
    const double periods = dt > 0.0 ? nearbyint(dt * rate_hz) : 0.0;
    const double counted = dt > 0.0 && periods < 1.0 ? 1.0 : periods;
    const double scale = counted > 0.0 && counted < 255.0 ? dt * rate_hz / counted : 1.0;
    made.periods = (uint8_t)(counted < 255.0 ? counted : 255.0);
    made.usable = (uint8_t)!isnan(gyro[0] + gyro[1] + gyro[2]);
    for (int i = 0; i < 3; i++) {
        made.imu.gyro[i] = quantised(gyro[i] * scale, 16777216.0, INT32_MAX);
    }
    quantise_q8(made.imu.accel, accel);
    quantise_q8(made.imu.mag, mag);
    return made;
}

static inline struct fixed_sample fixed_row(const struct recording *in, int64_t k)
{
    return fixed_sample(in->gyro + 3 * k, in->accel + 3 * k, in->mag == NULL ? NULL : in->mag + 3 * k,
                        interval(in, k), in->rate_hz);
}

/* Q30 to numbers of length 1, the one of both signs whose w is not negative. */
static inline void store_q30(double *path, int64_t k, const int32_t q[4])
{
    double squared = 0.0;
    for (int i = 0; i < 4; i++) {
        squared += (double)q[i] * (double)q[i];
    }
    const double scale = (q[0] < 0 ? -1.0 : 1.0) / sqrt(squared);
    for (int i = 0; i < 4; i++) {
        path[4 * k + i] = scale * (double)q[i];
    }
}

#endif /* FACTORLAB_FIXED_BINDING_H */
