/* The samples of agree.c: calm motion, noise of all bits, the ends of the formats, zeros, and periods that drop out.
 *
 * Source: Marsaglia's xorshift (2003).
 */
#ifndef FACTORLAB_AGREE_SAMPLES_H
#define FACTORLAB_AGREE_SAMPLES_H

#include <stdint.h>

#include "../core/imu.h"

static uint32_t random_state;
static struct imu_q sample;
static uint8_t periods;

static uint32_t random_bits(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

/* One of the numbers at which arithmetic goes wrong. */
static int32_t extreme(void)
{
    static const int32_t ends[8] = {0, 1, -1, INT32_MAX, -INT32_MAX, INT32_C(0x40000000), INT32_C(0x8000), -INT32_C(0x8000)};
    const uint8_t which = (uint8_t)(random_bits() >> 24) & 15U;

    return which < 8U ? ends[which] : (which == 8U ? INT32_MIN : (int32_t)random_bits());
}

/* Calm in three quarters of all runs of 64 samples. */
static void next_sample(uint32_t k)
{
    static uint8_t kind;

    if ((k & 63U) == 0U) {
        kind = (uint8_t)(random_bits() >> 24);
    }
    periods = (random_bits() >> 25) == 0U ? (uint8_t)(random_bits() >> 24) : 1;
    for (uint8_t i = 0; i < 3; i++) {
        if (kind < 192U) {
            sample.gyro[i] += ((int32_t)random_bits() >> 9) - (sample.gyro[i] >> 4);
            sample.accel[i] = (int16_t)((i == 2U ? 2511 : 0) + ((int32_t)random_bits() >> 23));
            sample.mag[i] = (kind & 1U) != 0 ? (int16_t)((i == 0U ? 5000 : -9000) + ((int32_t)random_bits() >> 22)) : 0;
        } else if (kind < 224U) {
            sample.gyro[i] = (int32_t)random_bits();
            sample.accel[i] = (int16_t)(uint16_t)random_bits();
            sample.mag[i] = (int16_t)(uint16_t)random_bits();
        } else {
            sample.gyro[i] = (kind & 2U) != 0 ? extreme() : 0;
            sample.accel[i] = (kind & 1U) != 0 ? (int16_t)(uint16_t)((uint32_t)extreme() >> 16) : 0;
            sample.mag[i] = (kind & 4U) != 0 ? (int16_t)(uint16_t)((uint32_t)extreme() >> 16) : 0;
        }
    }
    if (kind < 192U && (k & 63U) == 0U) {
        sample.gyro[0] = sample.gyro[1] = sample.gyro[2] = 0; /* after what noise has left */
    }
}

/* The same samples once more. */
static void first_again(void)
{
    random_state = UINT32_C(2463534242);
    for (uint8_t i = 0; i < 3; i++) {
        sample.gyro[i] = 0;
    }
}

#endif /* FACTORLAB_AGREE_SAMPLES_H */
