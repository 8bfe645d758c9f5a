#include "calibration_q.h"

#include <stddef.h>

/* Row * raw - shift, rounded from Q32 to Q24: the sum has less than 50 bits, whatever the numbers. */
static int32_t calibrated_axis(const int32_t row[3], const int16_t raw[3], int32_t shift)
{
    int64_t sum = 128; /* half of a unit of Q24 */

    for (uint8_t i = 0; i < 3; i++) {
        if (row[i] != 0) {
            sum += (int64_t)row[i] * raw[i];
        }
    }
    sum = (sum >> 8) - shift;
    if (sum > INT32_MAX) {
        return INT32_MAX;
    }
    return sum < INT32_MIN ? INT32_MIN : (int32_t)sum;
}

void calibrate_q24(const struct affine_q *affine, const int16_t raw[3], int32_t calibrated[3])
{
    for (uint8_t i = 0; i < 3; i++) {
        calibrated[i] = calibrated_axis(affine->matrix[i], raw, affine->shift[i]);
    }
}

void calibrate_q8(const struct affine_q *affine, const int16_t raw[3], int16_t calibrated[3])
{
    const int32_t half = INT32_C(1) << 15; /* of a unit of Q8 */

    for (uint8_t i = 0; i < 3; i++) {
        int32_t fine = calibrated_axis(affine->matrix[i], raw, affine->shift[i]);

        calibrated[i] = fine > INT32_MAX - half ? INT16_MAX : (int16_t)((fine + half) >> 16);
    }
}

/* A reading of zeros says that there is none, before and after. */
static void calibrate_present(const struct affine_q *affine, const int16_t raw[3], int16_t calibrated[3])
{
    if ((raw[0] | raw[1] | raw[2]) != 0) {
        calibrate_q8(affine, raw, calibrated);
    } else {
        calibrated[0] = calibrated[1] = calibrated[2] = 0;
    }
}

void calibrate_q(const struct affine_q *gyro, const struct affine_q *accel, const struct affine_q *mag,
                 const struct imu_raw *raw, struct imu_q *calibrated)
{
    calibrate_q24(gyro, raw->gyro, calibrated->gyro);
    calibrate_present(accel, raw->accel, calibrated->accel);
    if (mag != NULL) {
        calibrate_present(mag, raw->mag, calibrated->mag);
    } else {
        calibrated->mag[0] = calibrated->mag[1] = calibrated->mag[2] = 0;
    }
}
