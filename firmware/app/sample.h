/* From counts to what a filter takes, and from a float filter to what a frame takes.
 *
 * Constants come from the header that FACTORLAB_CALIBRATION names (`factorlab calibrate ... --c-header`), or from
 * the data sheet.
 *
 * What it does with bad input: any counts; a float that is not finite or out of range becomes 0.
 */
#ifndef FACTORLAB_SAMPLE_H
#define FACTORLAB_SAMPLE_H

#include <stddef.h>
#include <stdint.h>

#include "../core/calibration_f32.h"
#include "../core/calibration_q.h"
#include "../core/imu.h"

#ifdef FACTORLAB_CALIBRATION
#include FACTORLAB_CALIBRATION
#else
#include "calibration_default.h"
#endif

#define COUNTS_ACCEL 0 /* places in ax ay az temperature gx gy gz */
#define COUNTS_GYRO 4

#define SAMPLE_PERIOD_S 0.01f /* s */

static inline void sample_q(const int16_t counts[7], struct imu_q *sample)
{
    struct imu_raw raw;
    for (uint8_t k = 0; k < 3; k++) {
        raw.accel[k] = counts[COUNTS_ACCEL + k];
        raw.gyro[k] = counts[COUNTS_GYRO + k];
        raw.mag[k] = 0;
    }
    calibrate_q(&gyro_calibration_q, &accel_calibration_q, NULL, &raw, sample);
}

static inline void sample_f32(const int16_t counts[7], struct imu_f32 *sample)
{
    const float none = 0.0f / 0.0f;
    calibrate_f32(&accel_calibration_f32, counts + COUNTS_ACCEL, sample->accel);
    calibrate_f32(&gyro_calibration_f32, counts + COUNTS_GYRO, sample->gyro);
    if ((counts[0] | counts[1] | counts[2]) == 0) { /* no sensor on Earth reads that */
        sample->accel[0] = sample->accel[1] = sample->accel[2] = none;
    }
    sample->mag[0] = sample->mag[1] = sample->mag[2] = none;
}

/* `value` in units of 1 / `one`, |value| < `limit`. */
static inline int32_t fixed_of(float value, float one, float limit)
{
    return value > -limit && value < limit ? (int32_t)(value * one) : 0;
}

static inline void quaternion_of(const float from[4], int32_t to[4] /* Q30 */)
{
    for (uint8_t k = 0; k < 4; k++) {
        to[k] = fixed_of(from[k], 1073741824.0f, 1.9f);
    }
}

static inline void bias_of(const float from[3] /* rad/s */, int32_t to[3] /* rad/s, Q24 */)
{
    for (uint8_t k = 0; k < 3; k++) {
        to[k] = fixed_of(from[k], 16777216.0f, 127.0f);
    }
}

static inline void quaternion_identity(int32_t world_q_body[4] /* Q30 */)
{
    world_q_body[0] = INT32_C(1) << 30;
    world_q_body[1] = world_q_body[2] = world_q_body[3] = 0;
}

#endif /* FACTORLAB_SAMPLE_H */
