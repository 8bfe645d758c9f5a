/* What all filters in fixed point have in common behind filter.h; constants are those of 100 samples a
 * second.
 *
 * The file that includes this says which one it is: MODULE its name, KIND its number in a boot frame, START_GYRO
 * what its start takes from the gyro; it adds `filter_bias` and `filter_status`.
 */
#include <string.h>

#include "../core/frame.h"
#include "filter.h"
#include "sample.h"

#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define OF(what) JOIN(MODULE, what)
#define DERIVED OF(_100hz)

const uint8_t filter_kind = KIND;
const uint32_t filter_calibration_hash = FACTORLAB_CALIBRATION_HASH;

static struct OF(_state) state;
static struct imu_q sample;
static int32_t attitude[4]; /* world_q_body, Q30 */
static uint8_t started; /* 1: a first sample has come */

void filter_start(void)
{
    started = 0;
    quaternion_identity(attitude);
}

void filter_accel(const int16_t accel[3])
{
    sample_accel_q(accel, &sample);
    if (started == 0U) { /* while the gyro is on the bus: to level the filter takes longer than to update it */
        sample.gyro[0] = sample.gyro[1] = sample.gyro[2] = 0;
        OF(_start)(&state, &DERIVED, &sample);
    }
}

void filter_update(const int16_t gyro[3], uint8_t periods)
{
    sample_gyro_q(gyro, &sample);
    if (started == 0U) {
        started = 1;
        periods = 0;
        START_GYRO(&state, &sample);
    }
    OF(_step)(&state, &DERIVED, &sample, periods);
    OF(_attitude)(&state, attitude);
}

void filter_attitude(int32_t world_q_body[4])
{
    (void)memcpy(world_q_body, attitude, sizeof attitude);
}
