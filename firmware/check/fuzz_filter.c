/* One filter of the core on any bytes: for libFuzzer, and for main() below on files.
 *
 * Built with -DFILTER_HEADER='"mahony_q.h"' -DMODULE=mahony_q -DFIXED_POINT=1 (or mahony_f32 and 0).  The first
 * byte says what the others are (and a test builds the rest of an input as it likes):
 *
 *     0   counts of a sensor: int16 for nine axes, a byte of trouble (NaN, zero, saturation, a drop-out)
 *     1   samples of any bits, each with its interval, from `start` on
 *     2   a state of any bits, then such samples: an overflow that only a wound-up state reaches is not found
 *         by samples alone
 *
 * After every step of 0 the attitude must be a rotation; of 1 too, where ANY_SAMPLE is 1.  The sanitizers judge
 * the rest: no signed overflow, no shift of what may not be shifted, no float that does not fit an integer, no access
 * out of bounds.
 */
#include FILTER_HEADER

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#define OF(name) JOINED(MODULE, name)

#if FIXED_POINT
typedef struct imu_q sample;
typedef int32_t component;
typedef uint8_t interval; /* periods */
#define ONE 1073741824.0 /* of Q30 */
#define NEAR 0.2         /* of its squared length: it is drawn back to 1 step by step */
#else
typedef struct imu_f32 sample;
typedef float component;
typedef float interval; /* s */
#define ONE 1.0
#define NEAR 0.01 /* of its squared length */
#endif

#ifndef ANY_SAMPLE
#define ANY_SAMPLE 0
#endif

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require_rotation(const struct OF(_state) *state)
{
    component q[4];
    double squared = 0.0;
    int i;
    OF(_attitude)(state, q);
    for (i = 0; i < 4; i++) {
        squared += (double)q[i] / ONE * ((double)q[i] / ONE);
    }
    if (!(fabs(squared - 1.0) < NEAR)) {
        fprintf(stderr, "the attitude has length %g\n", sqrt(squared));
        __builtin_trap();
    }
}

static void derive(struct OF(_derived) *derived)
{
    struct OF(_settings) settings;
    OF(_defaults)(&settings);
#if FIXED_POINT
    OF(_derive)(&settings, 100, derived);
#else
    OF(_derive)(&settings, derived);
#endif
}

#define COUNTS_ROW 19U /* nine axes of two bytes, and a byte of trouble */

/* What a sensor of +-2000 deg/s, +-16 g and +-4900 uT says in counts, with trouble in one of its parts. */
static void from_counts(const uint8_t *row, sample *one, interval *since)
{
    int16_t counts[9];
    const uint8_t trouble = row[18];
    int i;
    memcpy(counts, row, sizeof counts);
    for (i = 0; i < 9; i++) {
        if (trouble % 8 == 1 + i / 3) { /* one sensor saturates, on every axis */
            counts[i] = counts[i] < 0 ? INT16_MIN : INT16_MAX;
        } else if (trouble % 8 == 4 + i / 3) {
            counts[i] = 0;
        }
    }
    for (i = 0; i < 3; i++) {
#if FIXED_POINT
        one->gyro[i] = counts[i] * INT32_C(17872); /* 2000 deg/s over 2^15, Q24 */
        one->accel[i] = counts[3 + i];
        one->mag[i] = counts[6 + i];
#else
        one->gyro[i] = (float)counts[i] * 1.0652644e-3f;
        one->accel[i] = (float)counts[3 + i] * 4.788e-3f;
        one->mag[i] = trouble % 16 == 8 ? NAN : (float)counts[6 + i] * 0.15f;
        one->accel[i] = trouble % 16 == 9 ? NAN : one->accel[i];
        one->gyro[i] = trouble % 16 == 10 ? NAN : one->gyro[i];
#endif
    }
    *since = trouble % 32 == 11 ? (interval)50 : (interval)1; /* 50 s, or periods: a drop-out */
#if !FIXED_POINT
    *since = trouble % 32 == 12 ? NAN : *since * 0.01f;
#endif
}

static size_t next(const uint8_t *data, uint8_t kind, sample *one, interval *since)
{
    if (kind == 0) {
        from_counts(data, one, since);
        return COUNTS_ROW;
    }
    memcpy(one, data, sizeof *one);
    memcpy(since, data + sizeof *one, sizeof *since);
    return sizeof *one + sizeof *since;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const uint8_t kind = size > 0 ? data[0] % 3 : 0;
    const size_t row = kind == 0 ? COUNTS_ROW : sizeof(sample) + sizeof(interval);
    struct OF(_derived) derived;
    struct OF(_state) state;
    sample one;
    interval since;
    int started = kind == 2;
    size_t at = 1;
    derive(&derived);
    if (started) {
        if (size < 1 + sizeof state) {
            return 0;
        }
        memcpy(&state, data + 1, sizeof state);
        at += sizeof state;
    }
    while (at + row <= size) {
        at += next(data + at, kind, &one, &since);
        if (!started) {
            OF(_start)(&state, &derived, &one);
            started = 1;
        }
        OF(_step)(&state, &derived, &one, since);
        if (kind == 0 || (kind == 1 && ANY_SAMPLE)) {
            require_rotation(&state);
        }
    }
    return 0;
}

#ifdef WITH_MAIN
static uint8_t input[1 << 24];

int main(int count, char **files)
{
    int i;
    for (i = 1; i < count; i++) {
        FILE *file = fopen(files[i], "rb");
        if (file == NULL) {
            fprintf(stderr, "cannot read %s\n", files[i]);
            return 1;
        }
        (void)LLVMFuzzerTestOneInput(input, fread(input, 1, sizeof input, file));
        fclose(file);
    }
    return 0;
}
#endif
