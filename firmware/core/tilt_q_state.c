/* The beginning of tilt_q.h, and what can be read from its state. */
#include "fixed_q.h"
#include "tilt_q.h"
#include "trig_q.h"

void tilt_q_start(struct tilt_q_state *s, const struct tilt_q_derived *d, const struct imu_q *first)
{
    const int16_t *a = first->accel;
    const uint8_t usable = (a[0] | a[1] | a[2]) != 0;
    uint32_t across;

    for (uint8_t i = 0; i < 3; i++) {
        struct tilt_q_channel *ch = &s->channel[i];
        ch->angle = 0;
        ch->bias = 0;
        ch->p = UINT32_C(0x40000000);
        ch->c = 0;
        ch->b = d->noise[i == 2U].first_bias;
        ch->b_below = 0;
        ch->known = (uint8_t)(usable & (i < 2U));
    }
    if (usable != 0U) {
        s->channel[0].angle = polar_q32(a[1], a[2], &across);
        s->channel[1].angle = atan2_q32(-(int32_t)a[0], (int32_t)across);
    }
    s->heading_known = 0;
    s->status = 0;
}

void tilt_q_angles(const struct tilt_q_state *s, int16_t roll_pitch_yaw[3])
{
    for (uint8_t i = 0; i < 3; i++) {
        roll_pitch_yaw[i] = (int16_t)(uint16_t)((s->channel[i].angle + 0x8000U) >> 16);
    }
}

void tilt_q_attitude(const struct tilt_q_state *s, int32_t world_q_body[4])
{
    int32_t sine[3];
    int32_t cosine[3];

    for (uint8_t i = 0; i < 3; i++) {
        /* half of an angle in [-180, 180[ deg */
        sincos_q((uint32_t)((int32_t)s->channel[i].angle >> 1), &sine[i], &cosine[i]);
    }
    const int32_t cc = mul32_q(cosine[0], cosine[1]); /* of roll and pitch, Q28 */
    const int32_t ss = mul32_q(sine[0], sine[1]);
    const int32_t sc = mul32_q(sine[0], cosine[1]);
    const int32_t cs = mul32_q(cosine[0], sine[1]);
    const int32_t q[4] = {
        mul32_q(cc, cosine[2]) + mul32_q(ss, sine[2]), /* Q26 */
        mul32_q(sc, cosine[2]) - mul32_q(cs, sine[2]),
        mul32_q(cs, cosine[2]) + mul32_q(sc, sine[2]),
        mul32_q(cc, sine[2]) - mul32_q(ss, cosine[2]),
    };
    for (uint8_t i = 0; i < 4; i++) {
        world_q_body[i] = q[i] * 16;
    }
}

void tilt_q_gyro_bias(const struct tilt_q_state *s, const struct tilt_q_derived *d, int32_t gyro_bias[3])
{
    int32_t sr, cr, sp, cp;
    int32_t of[3];

    for (uint8_t i = 0; i < 3; i++) {
        of[i] = mul32_q(s->channel[i].bias, d->rate);
    }
    sincos_q(s->channel[0].angle, &sr, &cr);
    sincos_q(s->channel[1].angle, &sp, &cp);
    const int32_t level = 4 * mul32_q(of[2], cp);
    gyro_bias[0] = of[0] - 4 * mul32_q(of[2], sp);
    gyro_bias[1] = 4 * (mul32_q(of[1], cr) + mul32_q(level, sr));
    gyro_bias[2] = 4 * (mul32_q(level, cr) - mul32_q(of[1], sr));
}
