/* What all filters in single precision have in common behind filter.h.
 *
 * The file that includes this says which one it is: MODULE its name, KIND its number in a boot frame, STEP
 * and ATTITUDE its functions of these names for a board without magnetometer; it adds `filter_bias` and
 * `filter_status`.
 */
#include <string.h>

#include "../core/frame.h"
#include "filter.h"
#include "sample.h"

#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define OF(what) JOIN(MODULE, what)

const uint8_t filter_kind = KIND;
const uint32_t filter_calibration_hash = FACTORLAB_CALIBRATION_HASH;

static struct OF(_derived) derived;
static struct OF(_state) state;
static struct imu_f32 sample;
static int32_t attitude[4]; /* world_q_body, Q30 */
static uint8_t started; /* 1: a first sample has come */

void filter_start(void)
{
    struct OF(_settings) settings;
    OF(_defaults)(&settings);
    OF(_derive)(&settings, &derived);
    started = 0;
    quaternion_identity(attitude);
}

void filter_accel(const int16_t accel[3])
{
    sample_accel_f32(accel, &sample);
}

void filter_update(const int16_t gyro[3], uint8_t periods)
{
    float estimate[4];
    sample_gyro_f32(gyro, &sample);
    if (started == 0U) {
        started = 1;
        periods = 0;
        OF(_start)(&state, &derived, &sample);
    }
    STEP(&state, &derived, &sample, (float)periods * SAMPLE_PERIOD_S);
    ATTITUDE(&state, estimate);
    quaternion_of(estimate, attitude);
}

void filter_attitude(int32_t world_q_body[4])
{
    (void)memcpy(world_q_body, attitude, sizeof attitude);
}
