/* The start of mahony_q.h: the attitude of yaw 0 in which a specific force points up. */
#include "mahony_q.h"

#if !defined(__AVR__) || defined(FACTORLAB_PORTABLE)

/* sqrt(x), rounded down, bit by bit. */
static uint16_t root(uint32_t x)
{
    uint16_t found = 0;
    for (uint16_t bit = 0x8000U; bit != 0U; bit >>= 1) {
        const uint16_t tried = found | bit;
        if ((uint32_t)tried * tried <= x) {
            found = tried;
        }
    }
    return found;
}

static uint32_t square2(uint16_t a, uint16_t b) { return (uint32_t)a * a + (uint32_t)b * b; }

/* c = sqrt((1 + cos) / 2) and s = sin / 2c, Q15, of the angle from 0 to 90 degrees whose cosine and sine
 * are as a to b. */
static void half_of(uint16_t a, uint16_t b, int16_t half[2])
{
    half[0] = INT16_MAX;
    half[1] = 0;
    if ((a | b) == 0U) {
        return;
    }
    if ((a | b) >= 0x8000U) {
        a = (uint16_t)(a >> 1);
        b = (uint16_t)(b >> 1);
    }
    while ((a | b) < 0x4000U) {
        a = (uint16_t)(a << 1);
        b = (uint16_t)(b << 1);
    }
    const uint16_t length = root(square2(a, b));
    const uint16_t mean = (uint16_t)(((uint32_t)length + a) >> 1);
    const uint16_t c = root(((((uint32_t)mean << 16) - 1U) / length) << 16);
    half[0] = (int16_t)(c >> 1);
    half[1] = (int16_t)((((uint32_t)b << 14) / length << 16) / c);
}

static void level(const int16_t accel[3], int32_t q[4])
{
    uint16_t size[3];
    int16_t roll[2]; /* cosine and sine of the half */
    int16_t pitch[2];
    uint16_t largest = 0;
    for (uint8_t i = 0; i < 3; i++) {
        size[i] = (uint16_t)accel[i];
        if (accel[i] < 0) {
            size[i] = (uint16_t)(0U - size[i]);
        }
        largest |= size[i];
    }
    if (largest == 0U) {
        return;
    }
    for (; largest < 0x4000U; largest = (uint16_t)(largest << 1)) {
        for (uint8_t i = 0; i < 3; i++) {
            size[i] = (uint16_t)(size[i] << 1);
        }
    }
    half_of(size[2], size[1], roll);
    half_of(root(square2(size[1], size[2])), size[0], pitch);
    if (accel[2] < 0) { /* beyond 90 degrees of roll, cosine and sine change places */
        const int16_t sine = roll[1];
        roll[1] = roll[0];
        roll[0] = sine;
    }
    if (accel[1] < 0) {
        roll[1] = (int16_t)-roll[1];
    }
    if (accel[0] >= 0) {
        pitch[1] = (int16_t)-pitch[1];
    }
    q[0] = (int32_t)roll[0] * pitch[0];
    q[1] = (int32_t)roll[1] * pitch[0];
    q[2] = (int32_t)roll[0] * pitch[1];
    q[3] = -(int32_t)roll[1] * pitch[1];
}

void mahony_q_start(struct mahony_q_state *s, const struct mahony_q_derived *d, const struct imu_q *first)
{
    uint8_t *bytes = (uint8_t *)s;
    for (uint8_t i = 0; i < sizeof *s; i++) {
        bytes[i] = 0;
    }
    s->q[0] = 0x40000000L;
    level(first->accel, s->q);
    for (uint8_t i = 0; i < 3; i++) {
        s->gyro_low[i] = first->gyro[i];
        s->accel_low[i][1] = (uint8_t)first->accel[i];
        s->accel_low[i][2] = (uint8_t)((uint16_t)first->accel[i] >> 8);
        s->turn_left[i] = 0x80; /* half of its unit: the turns round */
    }
    s->start_left = d->start_periods;
}

#endif
