/* One sample of an inertial sensor, as the filters of this folder take it.
 *
 * Axes are right-handed and the same for all three sensors; at rest the accelerometer reads the specific
 * force, +g along the axis that points up.  The reading of the gyro holds for the time since the sample
 * before.
 *
 * What stands for a missing reading: NaN in any axis (`imu_f32`); zeros in all three (`imu_q`, field and
 * specific force: neither is zero on Earth).  A filter meets anything else that a sensor can say, and each
 * header tells how.
 */
#ifndef FACTORLAB_IMU_H
#define FACTORLAB_IMU_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* In single precision. */
struct imu_f32 {
    float gyro[3];  /* rad/s */
    float accel[3]; /* m/s^2, specific force */
    float mag[3];   /* uT; NaN: no reading came with this sample */
};

/* In fixed point: +-128 rad/s, +-128 m/s^2, +-128 uT. */
struct imu_q {
    int32_t gyro[3];  /* rad/s, Q24 */
    int16_t accel[3]; /* m/s^2, Q8 */
    int16_t mag[3];   /* uT, Q8; all 0: no reading came with this sample */
};

/* As the sensor's registers hold it. */
struct imu_raw {
    int16_t accel[3]; /* counts */
    int16_t gyro[3];  /* counts */
    int16_t mag[3];   /* counts; all 0: no reading came with this sample */
};

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_IMU_H */
