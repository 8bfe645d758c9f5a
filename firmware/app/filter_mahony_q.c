/* mahony_q behind filter.h: Mahony's filter in fixed point, 6-D. */
#include "../core/frame.h"
#include "../core/mahony_q.h"
#include "../core/mahony_q_100hz.h"
#include "filter.h"
#include "sample.h"

const uint8_t filter_kind = BOOT_MAHONY_Q;
const uint32_t filter_calibration_hash = FACTORLAB_CALIBRATION_HASH;

static struct mahony_q_state state;
static struct imu_q sample;
static uint8_t started; /* 1: a first sample has come */

void filter_start(void)
{
    started = 0;
}

void filter_accel(const int16_t accel[3])
{
    sample_accel_q(accel, &sample);
}

void filter_update(const int16_t gyro[3], uint8_t periods)
{
    sample_gyro_q(gyro, &sample);
    if (started == 0U) {
        started = 1;
        periods = 0;
        mahony_q_start(&state, &mahony_q_100hz, &sample);
    }
    mahony_q_step(&state, &mahony_q_100hz, &sample, periods);
}

void filter_attitude(int32_t world_q_body[4])
{
    if (started == 0U) {
        quaternion_identity(world_q_body);
    } else {
        mahony_q_attitude(&state, world_q_body);
    }
}

void filter_bias(int32_t bias[3])
{
    for (uint8_t k = 0; k < 3; k++) {
        bias[k] = state.bias[k] >> 8; /* Q32 to Q24 */
    }
}

uint8_t filter_status(void)
{
    return state.status; /* its bits are those of a frame */
}
