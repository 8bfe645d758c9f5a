/* The complementary filter in single precision; it has no bias. */
#include "../core/complementary_f32.h"

#define MODULE complementary_f32
#define KIND BOOT_COMPLEMENTARY_F32
#define STEP complementary_f32_step
#define ATTITUDE complementary_f32_attitude
#include "filter_f32.h"

void filter_bias(int32_t bias[3])
{
    bias[0] = bias[1] = bias[2] = 0;
}

uint8_t filter_status(void)
{
    return 0;
}
