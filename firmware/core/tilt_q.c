/* The step of tilt_q.h: rates of the angles, prediction, folding, correction. */
#include "tilt_q.h"

#include "divide_q.h"
#include "fixed_q.h"
#include "trig_q.h"

#define ROLL 0
#define PITCH 1
#define YAW 2
#define QUARTER UINT32_C(0x40000000) /* 90 deg; 1, Q30 */
#define STEEP INT32_C(0x03333333)    /* 0.05, Q30: the least cosine that is divided by */
#define P_LIMIT UINT32_C(0xBFFE0000) /* 3, Q30 */
#define B_LIMIT UINT32_C(0x3FFFFFFF) /* 1/4 of what 32 bits hold */
#define NO_GATE UINT32_C(0xFFFFFFFF)

/* x / cosine for cosine > 0, Q30, saturated: x (1 + d), so that d's rounding counts only as d does. */
static int32_t over_cosine(int32_t x, int32_t cosine)
{
    const uint16_t by = (uint16_t)((uint32_t)cosine >> 15); /* Q15 */
    uint32_t above = (QUARTER - (uint32_t)cosine) << 1;     /* Q31 */
    uint8_t doublings = 0;
    int32_t extra;

    if (cosine >= (int32_t)QUARTER) {
        return x;
    }
    while ((uint16_t)(above >> 16) >= by) {
        above >>= 1;
        doublings++;
    }
    extra = mul32u16_q(x, divide_q(above + (by >> 1), by));
    while (doublings > 0U) {
        extra = add_q(extra, extra);
        doublings--;
    }
    return add_q(x, extra);
}

/* Rates of roll, pitch and yaw, Q22, of the gyro's, Q24, at the state's angles. */
static void rates(const struct tilt_q_state *s, const int32_t gyro[3], int32_t rate[3])
{
    int32_t sr, cr, sp, cp;

    sincos_q(s->channel[ROLL].angle, &sr, &cr);
    sincos_q(s->channel[PITCH].angle, &sp, &cp);
    rate[PITCH] = mul32_q(gyro[1], cr) - mul32_q(gyro[2], sr);
    rate[YAW] = over_cosine(mul32_q(gyro[1], sr) + mul32_q(gyro[2], cr), cp > STEEP ? cp : STEEP);
    rate[ROLL] = add_q(((gyro[0] >> 1) + 1) >> 1, 4 * clamp_q(mul32_q(rate[YAW], sp), 0x1FFFFFFF));
}

/* One period: F = [1 -1; 0 1], the rate is `turn` of 2^-32 turns. */
static void predict(struct tilt_q_channel *ch, const struct tilt_q_noise *noise, uint32_t turn)
{
    const uint32_t b = ch->b < B_LIMIT ? ch->b : B_LIMIT;
    const uint8_t finer = noise->finer;
    const int32_t change = (int32_t)(noise->angle + (((b >> (7U + finer)) + 1U) >> 1)) -
                           (((ch->c >> (6U + finer)) + 1) >> 1);
    const uint16_t below = (uint16_t)(ch->b_below + (uint16_t)noise->bias);

    ch->angle += turn - (uint32_t)(((ch->bias >> 7) + 1) >> 1);
    if (change < 0) {
        ch->p = ch->p > (uint32_t)-change ? ch->p - (uint32_t)-change : 0;
    } else if (ch->p < P_LIMIT - (uint32_t)change) {
        ch->p += (uint32_t)change;
    } else {
        ch->p = P_LIMIT;
    }
    ch->c = add_q(ch->c, -(int32_t)(b + (ch->b_below >> 15)) - noise->both);
    ch->b = b + (noise->bias >> 16) + (below < ch->b_below ? 1U : 0U);
    ch->b_below = below;
}

/* 2^62 / x for 2^30 <= x: one step of Newton's on 16 bits; all ones for 2^30. */
static uint32_t inverse(uint32_t x)
{
    const uint16_t first = divide_q(QUARTER, (uint16_t)((x + 0x8000U) >> 16)); /* Q16 */
    const int32_t off = INT32_C(0x20000000) - mul32u16_q((int32_t)(x >> 1), first); /* 1 - x first, Q29 */

    return ((uint32_t)first << 16) + (uint32_t)(INT32_C(8) * high16_q(mul16u_q(narrow_q(off), first)));
}

/* b <- b - c (c g), not below 0. */
static void take(struct tilt_q_channel *ch, int32_t c, uint8_t finer)
{
    uint32_t whole;
    uint16_t below;

    if (ch->c >= -0x7FFFFF && ch->c <= 0x7FFFFF) { /* so small that both may have 8 bits more */
        whole = (uint32_t)mul32_q(ch->c * 256, c * 256) >> (6U + finer);
        below = (uint16_t)whole;
        whole >>= 16;
    } else {
        whole = (uint32_t)mul32_q(ch->c, c);
        below = (uint16_t)(whole << (10U - finer));
        whole >>= 6U + finer;
    }
    if (below > ch->b_below) {
        whole++;
    }
    ch->b_below = ch->b >= whole ? (uint16_t)(ch->b_below - below) : 0;
    ch->b = ch->b >= whole ? ch->b - whole : 0;
}

/* The new c times an innovation, 2^-32 turns, to Q8. */
static int32_t learnt(int32_t c, int32_t innovation, uint8_t finer)
{
    const int32_t change = mul32_q(c, innovation);

    if (finer > 2U) {
        return ((change >> (finer - 3U)) + 1) >> 1;
    }
    return up_q(clamp_q(change, 0x1FFFFFFF), (uint8_t)(2U - finer));
}

/* By an angle; 0 if it is beyond the gate. */
static uint8_t correct(struct tilt_q_channel *ch, const struct tilt_q_derived *d, const struct tilt_q_noise *noise,
                       uint32_t measured)
{
    const int32_t innovation = (int32_t)(measured - ch->angle); /* the short way round */
    uint32_t gain = noise->unknown_gain;                        /* Q32 */

    if (ch->known != 0U) {
        const int16_t coarse = (int16_t)(innovation >> 16);
        if (noise->gate != NO_GATE &&
            (uint32_t)mul16_q(coarse, coarse) > noise->gate + (noise->gate >> 8) * (ch->p >> 22)) {
            return 0;
        }
        const uint32_t rest = inverse(QUARTER + ch->p); /* 1 - gain, Q32 */
        const int32_t c = mul32_q(ch->c, (int32_t)(rest >> 1)) * 2;
        gain = 0U - rest;
        ch->bias = clamp_q(add_q(ch->bias, learnt(c, innovation, noise->finer)), d->bias_limit);
        take(ch, c, noise->finer);
        ch->c = c;
    } else {
        ch->c = 0;
        ch->known = 1;
    }
    ch->angle += 2U * (uint32_t)mul32_q(innovation, (int32_t)(gain >> 1));
    ch->p = (gain + 2U) >> 2;
    return 1;
}

/* Over the top, pitch comes back down and roll and yaw turn by half a turn. */
static void fold(struct tilt_q_state *s)
{
    if (s->channel[PITCH].angle + QUARTER > 2U * QUARTER) {
        s->channel[PITCH].angle = 2U * QUARTER - s->channel[PITCH].angle;
        s->channel[PITCH].bias = minus_q(0, s->channel[PITCH].bias);
        s->channel[ROLL].angle += 2U * QUARTER;
        s->channel[YAW].angle += 2U * QUARTER;
    }
}

/* Roll and pitch by gravity. */
static void level(struct tilt_q_state *s, const struct tilt_q_derived *d, const int16_t accel[3])
{
    uint32_t across;
    const uint32_t roll = polar_q32(accel[1], accel[2], &across);
    const uint32_t pitch = atan2_q32(-(int32_t)accel[0], (int32_t)across);
    const uint8_t used = correct(&s->channel[ROLL], d, &d->noise[0], roll);

    if ((correct(&s->channel[PITCH], d, &d->noise[0], pitch) & used) == 0U) {
        s->status |= TILT_Q_ACCEL_REJECTED;
    }
    fold(s);
}

/* Yaw by the field, levelled. */
static void head(struct tilt_q_state *s, const struct tilt_q_derived *d, const int16_t mag[3])
{
    struct tilt_q_channel *yaw = &s->channel[YAW];
    int32_t sr, cr, sp, cp;
    uint32_t measured;

    sincos_q(s->channel[ROLL].angle, &sr, &cr);
    sincos_q(s->channel[PITCH].angle, &sp, &cp);
    const int32_t down = mul32x16_q(sr, mag[1]) + mul32x16_q(cr, mag[2]); /* uT, Q22 */
    const int32_t left = mul32x16_q(cr, mag[1]) - mul32x16_q(sr, mag[2]);
    const int32_t ahead = (mul32x16_q(cp, mag[0]) >> 2) + mul32_q(down, sp); /* Q20 */

    measured = atan2_q32(ahead, left >> 2);
    if (s->heading_known == 0U) {
        s->heading_known = 1;
        yaw->known = 1;
        yaw->angle = measured;
        yaw->p = QUARTER;
        yaw->c = 0;
    } else if (correct(yaw, d, &d->noise[1], measured) == 0U) {
        s->status |= TILT_Q_MAG_DISTURBED;
    }
}

void tilt_q_step(struct tilt_q_state *s, const struct tilt_q_derived *d, const struct imu_q *sample, uint8_t periods)
{
    s->status = 0;
    if (periods > d->pause_periods) {
        periods = 0;
        for (uint8_t i = 0; i < 3; i++) {
            s->channel[i].known = 0;
        }
    }
    if (periods > 0U) {
        int32_t rate[3];

        rates(s, sample->gyro, rate);
        for (uint8_t i = 0; i < 3; i++) {
            const uint32_t turn = (uint32_t)mul32_q(rate[i], d->turn) << 3;
            for (uint8_t n = 0; n < periods; n++) {
                predict(&s->channel[i], &d->noise[i == YAW], turn);
            }
        }
        fold(s);
        if ((sample->accel[0] | sample->accel[1] | sample->accel[2]) != 0) {
            level(s, d, sample->accel);
        } else {
            s->status |= TILT_Q_ACCEL_REJECTED;
        }
    }
    if ((sample->mag[0] | sample->mag[1] | sample->mag[2]) != 0) {
        head(s, d, sample->mag);
    }
}
