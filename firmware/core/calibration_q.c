#include "calibration_q.h"

#include <stddef.h>

#ifdef __AVR__
#include "calibration_avr.h"
#else
/* Q24, rounded from Q32: the sums have less than 50 bits, whatever the numbers. */
static void calibrated(const struct affine_q *affine, const int16_t raw[3], int32_t fine[3])
{
    for (uint8_t i = 0; i < 3; i++) {
        int64_t sum = 128; /* half of a unit of Q24 */

        for (uint8_t j = 0; j < 3; j++) {
            sum += (int64_t)affine->matrix[i][j] * raw[j];
        }
        sum = (sum >> 8) - affine->shift[i];
        if (sum > INT32_MAX) {
            fine[i] = INT32_MAX;
        } else {
            fine[i] = sum < INT32_MIN ? INT32_MIN : (int32_t)sum;
        }
    }
}
#endif

void calibrate_q24(const struct affine_q *affine, const int16_t raw[3], int32_t out[3])
{
    calibrated(affine, raw, out);
}

void calibrate_q8(const struct affine_q *affine, const int16_t raw[3], int16_t out[3])
{
    const int32_t half = INT32_C(1) << 15; /* of a unit of Q8 */
    int32_t fine[3];

    calibrated(affine, raw, fine);
    for (uint8_t i = 0; i < 3; i++) {
        out[i] = fine[i] > INT32_MAX - half ? INT16_MAX : (int16_t)((fine[i] + half) >> 16);
    }
}

/* A reading of zeros says that there is none, before and after. */
static void calibrate_present(const struct affine_q *affine, const int16_t raw[3], int16_t out[3])
{
    if ((raw[0] | raw[1] | raw[2]) != 0) {
        calibrate_q8(affine, raw, out);
    } else {
        out[0] = out[1] = out[2] = 0;
    }
}

void calibrate_q(const struct affine_q *gyro, const struct affine_q *accel, const struct affine_q *mag,
                 const struct imu_raw *raw, struct imu_q *out)
{
    calibrate_q24(gyro, raw->gyro, out->gyro);
    calibrate_present(accel, raw->accel, out->accel);
    if (mag != NULL) {
        calibrate_present(mag, raw->mag, out->mag);
    } else {
        out->mag[0] = out->mag[1] = out->mag[2] = 0;
    }
}
