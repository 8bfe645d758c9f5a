/* The error-state filter in single precision, for boards with a floating-point unit. */
#include "../core/error_state_f32.h"

#define MODULE error_state_f32
#define KIND BOOT_ERROR_STATE_F32
#define STEP error_state_f32_step
#define ATTITUDE error_state_f32_heading_free
#include "filter_f32.h"

void filter_bias(int32_t bias[3])
{
    float estimate[3];
    error_state_f32_bias(&state, estimate);
    bias_of(estimate, bias);
}

uint8_t filter_status(void)
{
    return state.resting != 0U ? FRAME_REST : 0;
}
