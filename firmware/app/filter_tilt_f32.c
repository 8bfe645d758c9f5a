/* The Kalman filter of angle and bias in single precision. */
#include "../core/tilt_f32.h"

#define MODULE tilt_f32
#define KIND BOOT_TILT_F32
#define STEP tilt_f32_step
#define ATTITUDE tilt_f32_attitude
#include "filter_f32.h"

void filter_bias(int32_t bias[3])
{
    float about_body[3];
    tilt_f32_gyro_bias(&state, about_body);
    bias_of(about_body, bias);
}

uint8_t filter_status(void)
{
    return 0;
}
