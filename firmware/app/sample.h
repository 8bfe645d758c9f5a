/* From counts to what a filter takes, and from a float filter to what a frame takes.
 *
 * Constants come from the header that FACTORLAB_CALIBRATION names (`factorlab calibrate ... --c-header`), or
 * from the data sheet.
 *
 * What it does with bad input: any counts; a float that is not finite or out of range becomes 0.
 */
#ifndef FACTORLAB_SAMPLE_H
#define FACTORLAB_SAMPLE_H

#include <stdint.h>

#include "../core/calibration_f32.h"
#include "../core/calibration_q.h"
#include "../core/imu.h"

#ifdef FACTORLAB_CALIBRATION
#include FACTORLAB_CALIBRATION
#else
#include "calibration_default.h"
#endif

#define SAMPLE_PERIOD_S 0.01f /* s */

static inline void sample_gyro_q(const int16_t counts[3], struct imu_q *sample)
{
    calibrate_q24(&gyro_calibration_q, counts, sample->gyro);
}

/* No sensor on Earth reads zeros: they stay zeros, which say that there is no reading. */
static inline void sample_accel_q(const int16_t counts[3], struct imu_q *sample)
{
    if ((counts[0] | counts[1] | counts[2]) == 0) {
        sample->accel[0] = sample->accel[1] = sample->accel[2] = 0;
    } else {
        calibrate_q8(&accel_calibration_q, counts, sample->accel);
    }
    sample->mag[0] = sample->mag[1] = sample->mag[2] = 0;
}

static inline void sample_gyro_f32(const int16_t counts[3], struct imu_f32 *sample)
{
    calibrate_f32(&gyro_calibration_f32, counts, sample->gyro);
}

static inline void sample_accel_f32(const int16_t counts[3], struct imu_f32 *sample)
{
    const float none = 0.0f / 0.0f;
    if ((counts[0] | counts[1] | counts[2]) == 0) {
        sample->accel[0] = sample->accel[1] = sample->accel[2] = none;
    } else {
        calibrate_f32(&accel_calibration_f32, counts, sample->accel);
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
