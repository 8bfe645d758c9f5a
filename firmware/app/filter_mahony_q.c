/* Mahony's filter in fixed point, 6-D. */
#include "../core/mahony_q.h"
#include "../core/mahony_q_100hz.h"

#define MODULE mahony_q
#define KIND BOOT_MAHONY_Q
#define START_GYRO(state, sample) memcpy((state)->gyro_low, (sample)->gyro, sizeof (state)->gyro_low)
#include "filter_q.h"

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
