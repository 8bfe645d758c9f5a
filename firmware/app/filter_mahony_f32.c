/* Mahony's filter in single precision, 6-D. */
#include "../core/mahony_f32.h"

#define MODULE mahony_f32
#define KIND BOOT_MAHONY_F32
#define STEP mahony_f32_step_6d
#define ATTITUDE mahony_f32_attitude
#include "filter_f32.h"

void filter_bias(int32_t bias[3])
{
    bias_of(state.gyro_bias, bias);
}

uint8_t filter_status(void)
{
    return mahony_f32_rests(&state, &derived) ? FRAME_REST : 0;
}
