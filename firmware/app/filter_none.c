/* No filter: a board that sends raw frames, to be recorded and worked on elsewhere.  Its attitude is the
 * identity. */
#include "filter.h"

#include "../core/frame.h"

const uint8_t filter_kind = BOOT_NO_FILTER;
const uint32_t filter_calibration_hash = 0;

void filter_start(void)
{
}

void filter_accel(const int16_t accel[3])
{
    (void)accel;
}

void filter_update(const int16_t gyro[3], uint8_t periods)
{
    (void)gyro;
    (void)periods;
}

void filter_attitude(int32_t world_q_body[4])
{
    world_q_body[0] = INT32_C(1) << 30;
    world_q_body[1] = world_q_body[2] = world_q_body[3] = 0;
}

void filter_bias(int32_t bias[3])
{
    bias[0] = bias[1] = bias[2] = 0;
}

uint8_t filter_status(void)
{
    return 0;
}
