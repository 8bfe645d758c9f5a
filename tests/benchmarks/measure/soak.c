/* A day of samples through one filter: soak SAMPLES.bin COUNT.
 *
 * SAMPLES.bin holds samples as they lie in memory (struct imu_f32 or imu_q); they are taken again and again, 100 a
 * second.  Prints the largest departure of the attitude's length from 1, that of the last sample, and how many
 * attitudes held no number.  Built with -DSOAK_MODULE=mahony_q, -DSOAK_HEADER and -DSOAK_FIXED, and with UBSan,
 * which stops it at the first overflow.
 */
#include SOAK_HEADER

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#if SOAK_FIXED
typedef struct imu_q sample;
typedef int32_t component;
#define ONE 1073741824.0
#else
typedef struct imu_f32 sample;
typedef float component;
#define ONE 1.0
#endif

#define LONGEST 200000
#define JOINED(a, b) a##b
#define NAMED(a, b) JOINED(a, b)
#define OF(name) NAMED(SOAK_MODULE, name)

static sample samples[LONGEST];
static struct OF(_state) state;
static struct OF(_derived) derived;

int main(int argc, char **argv)
{
    struct OF(_settings) settings;
    FILE *file = argc == 3 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL) {
        return 2;
    }
    const size_t rows = fread(samples, sizeof samples[0], LONGEST, file);
    const long count = atol(argv[2]);
    double worst = 0.0, last = 0.0;
    long wrong = 0;
    OF(_defaults)(&settings);
#if SOAK_FIXED
    OF(_derive)(&settings, 100, &derived);
#else
    OF(_derive)(&settings, &derived);
#endif
    OF(_start)(&state, &derived, &samples[0]);
    for (long k = 0; k < count; k++) {
        component q[4];
        double squared = 0.0;
#if SOAK_FIXED
        OF(_step)(&state, &derived, &samples[(size_t)k % rows], 1);
#else
        OF(_step)(&state, &derived, &samples[(size_t)k % rows], 0.01f);
#endif
        OF(_attitude)(&state, q);
        for (int i = 0; i < 4; i++) {
            squared += (double)q[i] / ONE * ((double)q[i] / ONE);
        }
        last = fabs(sqrt(squared) - 1.0);
        if (isfinite(last)) {
            worst = last > worst ? last : worst;
        } else {
            wrong++;
        }
    }
    printf("%.9g %.9g %ld\n", worst, last, wrong);
    return 0;
}
