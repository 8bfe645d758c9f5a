/* The start of mahony_q.h: the attitude of yaw 0 in which a specific force points up. */
#include "mahony_q.h"

#include "fixed_q.h"

#define ONE_Q15 0x7FFF
#define ONE_Q30 0x40000000L

/* (c, s) along the half of the angle whose cosine and sine are (cosine, sine) / length, of unit length, Q15. */
static void half_of(int16_t cosine, int16_t sine, uint16_t length, int16_t *c, int16_t *s)
{
    const uint16_t beside = (uint16_t)(sine < 0 ? -(int32_t)sine : sine);
    uint16_t along = (uint16_t)(length + (uint16_t)(cosine < 0 ? -(int32_t)cosine : cosine));
    uint16_t across = beside;
    uint32_t squared = (uint32_t)along * along + (uint32_t)across * across;
    *c = ONE_Q15;
    *s = 0;
    if (squared == 0) {
        return;
    }
    while (squared < 0x40000000UL) {
        squared <<= 2;
        along = (uint16_t)(along << 1);
        across = (uint16_t)(across << 1);
    }
    const uint16_t inverse = inverse_sqrt_q(squared);
    const int16_t longer = (int16_t)(((uint32_t)along * inverse) >> 16);
    const int16_t shorter = (int16_t)(((uint32_t)across * inverse) >> 16);
    *c = cosine < 0 ? shorter : longer;
    *s = cosine < 0 ? longer : shorter;
    if (sine < 0) {
        *s = (int16_t)-*s;
    }
}

static void level(const int16_t accel[3], int32_t q[4])
{
    int16_t a[3]; /* a quarter, so that sums fit */
    int16_t cos_roll;
    int16_t sin_roll;
    int16_t cos_pitch;
    int16_t sin_pitch;
    uint8_t small = 1;
    for (uint8_t i = 0; i < 3; i++) {
        if (accel[i] <= -0x2000 || accel[i] >= 0x2000) {
            small = 0;
        }
    }
    for (uint8_t i = 0; i < 3; i++) {
        a[i] = (int16_t)(small ? accel[i] : accel[i] >> 2);
    }
    const uint32_t across = (uint32_t)mul16_q(a[1], a[1]) + (uint32_t)mul16_q(a[2], a[2]);
    const uint16_t flat = sqrt_q(across);
    half_of(a[2], a[1], flat, &cos_roll, &sin_roll);
    half_of((int16_t)flat, (int16_t)-a[0], sqrt_q(across + (uint32_t)mul16_q(a[0], a[0])), &cos_pitch, &sin_pitch);
    q[0] = mul16_q(cos_roll, cos_pitch);
    q[1] = mul16_q(sin_roll, cos_pitch);
    q[2] = mul16_q(cos_roll, sin_pitch);
    q[3] = -mul16_q(sin_roll, sin_pitch);
}

void mahony_q_start(struct mahony_q_state *s, const struct mahony_q_derived *d, const struct imu_q *first)
{
    const struct mahony_q_state empty = {{ONE_Q30, 0, 0, 0}, {0}, {0}, {{0}}, {{0}}, {0}, 0, 0, 0};
    *s = empty;
    level(first->accel, s->q);
    for (uint8_t i = 0; i < 3; i++) {
        s->gyro_low[i] = first->gyro[i];
        s->accel_low[i][1] = (uint8_t)first->accel[i];
        s->accel_low[i][2] = (uint8_t)((uint16_t)first->accel[i] >> 8);
        s->turn_left[i] = 0x80; /* half of its unit: the turns round */
    }
    s->start_left = d->start_periods;
}
