/* mahony_f32 behind filter.h: Mahony's filter in single precision, 6-D. */
#include "../core/frame.h"
#include "../core/mahony_f32.h"
#include "filter.h"
#include "sample.h"

const uint8_t filter_kind = BOOT_MAHONY_F32;
const uint32_t filter_calibration_hash = FACTORLAB_CALIBRATION_HASH;

static struct mahony_f32_derived derived;
static struct mahony_f32_state state;
static struct imu_f32 sample;
static uint8_t started; /* 1: a first sample has come */

void filter_start(void)
{
    struct mahony_f32_settings settings;
    mahony_f32_defaults(&settings);
    mahony_f32_derive(&settings, &derived);
    started = 0;
}

void filter_accel(const int16_t accel[3])
{
    sample_accel_f32(accel, &sample);
}

void filter_update(const int16_t gyro[3], uint8_t periods)
{
    sample_gyro_f32(gyro, &sample);
    if (started == 0U) {
        started = 1;
        periods = 0;
        mahony_f32_start(&state, &derived, &sample);
    }
    mahony_f32_step_6d(&state, &derived, &sample, (float)periods * SAMPLE_PERIOD_S);
}

void filter_attitude(int32_t world_q_body[4])
{
    if (started == 0U) {
        quaternion_identity(world_q_body);
    } else {
        quaternion_of(state.world_q_body, world_q_body);
    }
}

void filter_bias(int32_t bias[3])
{
    bias_of(state.gyro_bias, bias);
}

uint8_t filter_status(void)
{
    return mahony_f32_rests(&state, &derived) ? FRAME_REST : 0;
}
