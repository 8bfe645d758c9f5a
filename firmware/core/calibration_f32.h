/* Calibration of a three-axis sensor in single precision: calibrated = matrix * (raw - offset).
 *
 * Source: the affine model of sequential.sensors.AffineCalibration (gain, misalignment and offset in one
 * matrix and one vector); `factorlab calibrate ... --c-header` writes the constants.
 *
 * Cost: 9 products and 12 sums; firmware/budget.csv.
 *
 * What it does with bad input: counts are integers, so nothing is NaN.  A saturated axis (-32768 or 32767)
 * comes out as the number it stands for; `saturated_i16` tells it from a reading.
 */
#ifndef FACTORLAB_CALIBRATION_F32_H
#define FACTORLAB_CALIBRATION_F32_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FACTORLAB_AFFINE_F32 /* headers of constants define it too, to be of use alone */
#define FACTORLAB_AFFINE_F32
struct affine_f32 {
    float matrix[3][3]; /* SI per count: rad/s, m/s^2 or uT */
    float offset[3];    /* counts */
};
#endif

static inline void calibrate_f32(const struct affine_f32 *calibration, const int16_t raw[3], float out[3])
{
    const float x = (float)raw[0] - calibration->offset[0];
    const float y = (float)raw[1] - calibration->offset[1];
    const float z = (float)raw[2] - calibration->offset[2];
    int i;
    for (i = 0; i < 3; i++) {
        const float *row = calibration->matrix[i];
        out[i] = row[0] * x + row[1] * y + row[2] * z;
    }
}

/* Whether any axis is at the end of its range, so that the truth may be beyond. */
static inline int saturated_i16(const int16_t raw[3])
{
    int i, found = 0;
    for (i = 0; i < 3; i++) {
        found |= raw[i] == INT16_MIN || raw[i] == INT16_MAX;
    }
    return found;
}

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_CALIBRATION_F32_H */
