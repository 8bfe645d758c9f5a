/* Whether fixed point is the same everywhere: every module on samples that the target makes itself, as checksums.
 *
 * Prints a line a module and block of 1 000 samples, "<module> <block> <checksum>", then "end": a computer, a Cortex-M4
 * and an AVR must print the same text.  Samples are calm motion, noise of all bits, the ends of the formats, zeros
 * and runs of them, with periods that drop out; the state is never reset, so that one wrong bit stays.
 *
 * AGREE_SAMPLES is their number; AGREE_MODULES chooses by bits (below), since an emulated AVR is slow.
 * Source: checksums by Fowler, Noll and Vo (FNV-1a over words).
 */
#include "../core/calibration_q.h"
#include "../core/complementary_q.h"
#include "../core/complementary_q_100hz.h"
#include "../core/fixed_q.h"
#include "../core/mahony_q.h"
#include "../core/mahony_q9.h"
#include "../core/mahony_q_100hz.h"
#include "../core/tilt_q.h"
#include "../core/tilt_q_100hz.h"
#include "../core/trig_q.h"

#include <stddef.h>

#include "agree_samples.h"
#include "agree_target.h"

#define TRIG 0x01
#define CALIBRATION 0x02
#define MAHONY 0x04
#define TILT 0x08
#define COMPLEMENTARY 0x10
#define MAHONY_9D 0x20

#ifndef AGREE_SAMPLES
#define AGREE_SAMPLES 20000UL
#endif
#ifndef AGREE_MODULES
#define AGREE_MODULES 0xFF
#endif
#define BLOCK 1000U

static uint32_t checksum;

static void add(uint32_t word)
{
    checksum = (checksum ^ word) * UINT32_C(16777619);
}

static void add_all(const int32_t *words, uint8_t count)
{
    for (uint8_t i = 0; i < count; i++) {
        add((uint32_t)words[i]);
    }
}

static void trig_step(uint8_t first)
{
    const int32_t y = extreme();
    const int32_t x = extreme();
    int32_t q[4];
    int32_t both[2];
    int16_t angles[3];
    uint32_t length;

    (void)first;
    add(polar_q32(y, x, &length));
    add(length);
    add((uint16_t)atan2_q(x >> 9, y >> 7));
    add((uint16_t)asin_q(y >> 1));
    sincos_q((uint32_t)x, &both[0], &both[1]);
    add_all(both, 2);
    for (uint8_t i = 0; i < 4; i++) {
        q[i] = extreme();
    }
    angles_q(q, angles);
    for (uint8_t i = 0; i < 3; i++) {
        add((uint16_t)angles[i]);
    }
}

static void calibration_step(uint8_t first)
{
    struct affine_q affine;
    struct imu_raw raw;
    struct imu_q out;

    (void)first;
    for (uint8_t i = 0; i < 3; i++) {
        for (uint8_t j = 0; j < 3; j++) {
            affine.matrix[i][j] = (sample.mag[0] & 1) != 0 ? extreme() : (int32_t)random_bits() >> 7;
        }
        affine.shift[i] = extreme();
        raw.gyro[i] = (int16_t)(uint16_t)random_bits();
        raw.accel[i] = sample.accel[i];
        raw.mag[i] = sample.mag[i];
    }
    calibrate_q(&affine, &affine, &affine, &raw, &out);
    add_all(out.gyro, 3);
    for (uint8_t i = 0; i < 3; i++) {
        add((uint16_t)out.accel[i]);
        add((uint16_t)out.mag[i]);
    }
}

static void mahony_step(uint8_t first)
{
    static struct mahony_q_state state;
    int32_t q[4];

    if (first != 0U) {
        mahony_q_start(&state, &mahony_q_100hz, &sample);
    }
    mahony_q_step(&state, &mahony_q_100hz, &sample, first != 0U ? 0 : periods);
    mahony_q_attitude(&state, q);
    add_all(q, 4);
    add_all(state.bias, 3);
    add(state.status);
}

static void mahony_9d_step(uint8_t first)
{
    static struct mahony_q9_derived derived; /* by the target's own floating point */
    static struct mahony_q9_state state;
    int32_t q[4];

    if (first != 0U) {
        struct mahony_q9_settings settings;

        mahony_q_defaults_9d(&settings);
        mahony_q_derive_9d(&settings, 100, &derived);
        mahony_q_start_9d(&state, &derived, &sample);
    }
    mahony_q_step_9d(&state, &derived, &sample, first != 0U ? 0 : periods);
    mahony_q_attitude_9d(&state, q);
    add_all(q, 4);
    add_all(state.tilt.bias, 3);
    add(state.tilt.status);
}

static void tilt_step(uint8_t first)
{
    static struct tilt_q_state state;
    static uint8_t sixteenth; /* what is only read is asked for seldom */
    int32_t q[4];

    if (first != 0U) {
        tilt_q_start(&state, &tilt_q_100hz, &sample);
    }
    tilt_q_step(&state, &tilt_q_100hz, &sample, first != 0U ? 0 : periods);
    if ((++sixteenth & 15U) == 0U) {
        tilt_q_attitude(&state, q);
        add_all(q, 4);
        tilt_q_gyro_bias(&state, &tilt_q_100hz, q);
        add_all(q, 3);
    }
    for (uint8_t i = 0; i < 3; i++) {
        add(state.channel[i].angle);
        add(state.channel[i].p);
        add((uint32_t)state.channel[i].c);
        add(state.channel[i].b);
    }
    add(state.status);
}

static void complementary_step(uint8_t first)
{
    static struct complementary_q_state state;

    if (first != 0U) {
        complementary_q_start(&state, &complementary_q_100hz, &sample);
    }
    complementary_q_step(&state, &complementary_q_100hz, &sample, first != 0U ? 0 : periods);
    add_all(state.q, 4);
    add(state.status);
}

/* `value` in 8 hexadecimal digits. */
static void print_hex(uint32_t value)
{
    for (uint8_t i = 0; i < 8; i++) {
        const uint8_t digit = (uint8_t)(value >> 28);
        target_print((char)(digit < 10U ? '0' + digit : 'a' - 10 + digit));
        value <<= 4;
    }
}

static void print_text(const char *text)
{
    while (*text != '\0') {
        target_print(*text++);
    }
}

static void run(const char *name, void (*step)(uint8_t first))
{
    first_again();
    checksum = UINT32_C(2166136261);
    for (uint32_t k = 0; k < AGREE_SAMPLES; k++) {
        next_sample(k);
        step(k == 0U);
        if ((k + 1U) % BLOCK == 0U) {
            print_text(name);
            target_print(' ');
            print_hex((k + 1U) / BLOCK);
            target_print(' ');
            print_hex(checksum);
            target_print('\n');
        }
    }
}

int main(void)
{
    target_start();
    if ((AGREE_MODULES & TRIG) != 0) {
        run("trig_q", trig_step);
    }
    if ((AGREE_MODULES & CALIBRATION) != 0) {
        run("calibration_q", calibration_step);
    }
    if ((AGREE_MODULES & MAHONY) != 0) {
        run("mahony_q", mahony_step);
    }
    if ((AGREE_MODULES & TILT) != 0) {
        run("tilt_q", tilt_step);
    }
    if ((AGREE_MODULES & COMPLEMENTARY) != 0) {
        run("complementary_q", complementary_step);
    }
    if ((AGREE_MODULES & MAHONY_9D) != 0) {
        run("mahony_q9", mahony_9d_step);
    }
    print_text("end\n");
    target_stop();
    return 0;
}
