/* Counts of an inertial sensor become SI, in fixed point.
 *
 *     calibrated = matrix * raw - shift,   shift = matrix * offset
 *
 * Gains, misalignment, frame and offset of one three-axis sensor.  The constants come from `factorlab calibrate
 * ... --c-header FILE`; app/calibration_default.h has those of the data sheet.
 *
 * Source: sequential.sensors.calibration.AffineCalibration.
 * Error: the sum is exact to 2^-32 SI and is rounded once, to nearest, ties upwards: within half a unit of the
 * last place of the result plus 2^15 * 2^-33 * 3 SI from the rounding of the matrix.
 * Cost: AVR see firmware/budget.csv; entries of the matrix that are zero cost nothing.
 *
 * What it does with bad input: any counts and any constants are allowed; results outside the format saturate.
 * Counts at the end of the sensor's range are calibrated as they are.  `calibrate_q` keeps a specific force or a
 * field of (0, 0, 0) counts, which no working sensor reads on Earth, as the (0, 0, 0) that says "none".
 */
#ifndef FACTORLAB_CALIBRATION_Q_H
#define FACTORLAB_CALIBRATION_Q_H

#include <stdint.h>

#include "imu.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FACTORLAB_AFFINE_Q /* headers of constants define it too, to be of use alone */
#define FACTORLAB_AFFINE_Q
struct affine_q {
    int32_t matrix[3][3]; /* SI (mag: uT) per count, Q32 */
    int32_t shift[3];     /* SI (mag: uT), Q24: matrix * offset */
};
#endif

/* To SI in Q24: a gyro's rad/s. */
void calibrate_q24(const struct affine_q *affine, const int16_t raw[3], int32_t out[3] /* SI, Q24 */);

/* To SI in Q8: m/s^2, uT. */
void calibrate_q8(const struct affine_q *affine, const int16_t raw[3], int16_t out[3] /* SI, Q8 */);

/* A whole sample; `mag` NULL: there is no magnetometer. */
void calibrate_q(const struct affine_q *gyro, const struct affine_q *accel, const struct affine_q *mag,
                 const struct imu_raw *raw, struct imu_q *out);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_CALIBRATION_Q_H */
