/* The complementary filter on rotations in fixed point. */
#include "../core/complementary_q.h"
#include "../core/complementary_q_100hz.h"

#define MODULE complementary_q
#define KIND BOOT_COMPLEMENTARY_Q
#define START_GYRO(state, sample) ((void)0)
#include "filter_q.h"

void filter_bias(int32_t bias[3])
{
    bias[0] = bias[1] = bias[2] = 0; /* it knows none */
}

uint8_t filter_status(void)
{
    return state.status; /* its bits are those of a frame */
}
