/* Calibration of an inertial sensor: calibrated = matrix * (raw - offset), raw in counts.
 * Source: data sheets of the MPU-6050 at +-2000 deg/s, +-8 g and the QMC5883L at +-8 G: uncalibrated
 */
#ifndef FACTORLAB_CALIBRATION_DEFAULT_H
#define FACTORLAB_CALIBRATION_DEFAULT_H

/* As in calibration_f32.h and calibration_q.h of the firmware's core, with which this may be included. */
#include <stdint.h>
#ifndef FACTORLAB_AFFINE_F32
#define FACTORLAB_AFFINE_F32
struct affine_f32 {
    float matrix[3][3]; /* SI (mag: uT) per count */
    float offset[3];    /* counts */
};
#endif
#ifndef FACTORLAB_AFFINE_Q
#define FACTORLAB_AFFINE_Q
struct affine_q {
    int32_t matrix[3][3]; /* SI (mag: uT) per count, Q32 */
    int32_t shift[3];     /* SI (mag: uT), Q24: matrix * offset */
};
#endif

/* First 4 bytes of the SHA-256 of calibration.json; 0: none */
#define FACTORLAB_CALIBRATION_HASH 0x00000000UL

/* gyro: rad/s from counts */
static const struct affine_f32 gyro_calibration_f32 = {
    {{0.00106526446f, 0.0f, 0.0f},
     {0.0f, 0.00106526446f, 0.0f},
     {0.0f, 0.0f, 0.00106526446f}},
    {0.0f, 0.0f, 0.0f}};
static const struct affine_q gyro_calibration_q = {
    {{4575276L, 0L, 0L},
     {0L, 4575276L, 0L},
     {0L, 0L, 4575276L}},
    {0L, 0L, 0L}};

/* accel: m/s^2 from counts */
static const struct affine_f32 accel_calibration_f32 = {
    {{0.0023942017f, 0.0f, 0.0f},
     {0.0f, 0.0023942017f, 0.0f},
     {0.0f, 0.0f, 0.0023942017f}},
    {0.0f, 0.0f, 0.0f}};
static const struct affine_q accel_calibration_q = {
    {{10283018L, 0L, 0L},
     {0L, 10283018L, 0L},
     {0L, 0L, 10283018L}},
    {0L, 0L, 0L}};

/* mag: uT from counts */
static const struct affine_f32 mag_calibration_f32 = {
    {{0.0333333351f, 0.0f, 0.0f},
     {0.0f, 0.0333333351f, 0.0f},
     {0.0f, 0.0f, 0.0333333351f}},
    {0.0f, 0.0f, 0.0f}};
static const struct affine_q mag_calibration_q = {
    {{143165577L, 0L, 0L},
     {0L, 143165577L, 0L},
     {0L, 0L, 143165577L}},
    {0L, 0L, 0L}};

#endif /* FACTORLAB_CALIBRATION_DEFAULT_H */
