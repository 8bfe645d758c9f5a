/* The Kalman filter of angle and bias in fixed point. */
#include "../core/tilt_q.h"
#include "../core/tilt_q_100hz.h"

#define MODULE tilt_q
#define KIND BOOT_TILT_Q
#define START_GYRO(state, sample) ((void)0)
#include "filter_q.h"

void filter_bias(int32_t bias[3])
{
    if (started == 0U) {
        bias[0] = bias[1] = bias[2] = 0;
    } else {
        tilt_q_gyro_bias(&state, &tilt_q_100hz, bias);
    }
}

uint8_t filter_status(void)
{
    return state.status; /* its bits are those of a frame */
}
