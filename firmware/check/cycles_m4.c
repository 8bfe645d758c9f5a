/* Instructions that one update of a filter takes on a Cortex-M4F, each update counted by itself.
 *
 * What it computes: reads samples (struct imu_f32 or imu_q, as they lie in memory) from the first argument,
 * runs MODULE's step on each and writes, a sample, a uint32 of instructions and the attitude (4 floats, or 4
 * int32 in Q30) to the second.  Built by factorlab.firmware.instructions with -DHEADER, -DSTEP and the names
 * below.
 * Source: QEMU runs 2^shift ns an instruction (-icount), and CMSDK timer 0 counts 25 MHz of that time: at
 * shift 10 one instruction is 25.6 counts, so that a difference of two readings is exact after rounding.
 * (DWT->CYCCNT reads 0.) An empty step is counted the same way and taken off.  Instructions are not cycles:
 * on silicon vsqrt and vdiv take 14, a load 2.
 */
#include HEADER

#include <stdint.h>

#include "../ports/cortex_m4/qemu/cmsdk.h"
#include "../ports/cortex_m4/qemu/semihosting.h"
#include "../ports/cortex_m4/startup.h"

#define NS_PER_INSTRUCTION 1024UL
#define NS_PER_COUNT (1000000000UL / CMSDK_CLOCK_HZ)
#define ROWS 256 /* samples a block */

#if FIXED_POINT
typedef struct imu_q sample;
typedef int32_t component;
typedef uint8_t interval; /* periods */
#else
typedef struct imu_f32 sample;
typedef float component;
typedef float interval; /* s */
#endif

typedef void step_function(struct STATE *, const struct DERIVED *, const sample *, interval);

struct update {
    uint32_t instructions;
    component world_q_body[4];
};

static struct STATE state;
static struct DERIVED derived;
static sample samples[ROWS];
static struct update updates[ROWS];

static __attribute__((noinline)) void empty(struct STATE *s, const struct DERIVED *d, const sample *i,
                                            interval t)
{
    (void)t;
    __asm volatile("" ::"r"(s), "r"(d), "r"(i));
}

static __attribute__((noinline)) uint32_t count(step_function *volatile step, const sample *one,
                                                interval since)
{
    TIMER0->value = UINT32_MAX;
    const uint32_t before = TIMER0->value;
    step(&state, &derived, one, since);
    const uint32_t after = TIMER0->value;
    const uint64_t ns = (uint64_t)(before - after) * NS_PER_COUNT;
    return (uint32_t)((ns + NS_PER_INSTRUCTION / 2) / NS_PER_INSTRUCTION);
}

static void prepare(void)
{
    struct SETTINGS settings;
    DEFAULTS(&settings);
#if FIXED_POINT
    DERIVE(&settings, RATE_HZ, &derived);
#else
    DERIVE(&settings, &derived);
#endif
    TIMER0->reload = UINT32_MAX;
    TIMER0->ctrl = 1;
}

int main(void)
{
    const interval period = FIXED_POINT ? (interval)1 : (interval)(1.0f / (float)RATE_HZ);
    const int32_t source = semihost_open(1, SEMIHOST_READ), sink = semihost_open(2, SEMIHOST_WRITE);
    int started = 0;
    prepare();
    for (;;) {
        const size_t rows = semihost_read(source, samples, sizeof samples) / sizeof samples[0];
        if (rows == 0) {
            semihost_exit(0);
        }
        for (size_t k = 0; k < rows; k++) {
            if (!started) {
                START(&state, &derived, &samples[k]);
            }
            const interval since = started ? period : (interval)0;
            const uint32_t call = count(empty, &samples[k], since);
            updates[k].instructions = count(STEP, &samples[k], since) - call;
            ATTITUDE(&state, updates[k].world_q_body);
            started = 1;
        }
        semihost_write(sink, updates, rows * sizeof updates[0]);
    }
}

__attribute__((section(".vectors"), used)) static const handler vectors[16] = {
    (handler)stack_top, reset_handler,   default_handler, default_handler, default_handler, default_handler,
    default_handler,    default_handler, default_handler, default_handler, default_handler, default_handler,
    default_handler,    default_handler, default_handler, default_handler,
};
