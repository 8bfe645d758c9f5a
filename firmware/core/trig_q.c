#include "trig_q.h"

#include "divide_q.h"
#include "fixed_q.h"

/* Angle in [0, 45] deg of 0 <= y <= x, x > 0: 2^32 = 360 deg; and the square of y / x, Q16. */
static uint32_t octant(uint32_t y, uint32_t x, uint16_t *squared)
{
    uint16_t slope;
    uint16_t u;
    uint16_t p;

    while (x < UINT32_C(0x1000000)) {
        x <<= 8;
        y <<= 8;
    }
    while (x < UINT32_C(0x80000000)) {
        x <<= 1;
        y <<= 1;
    }
    slope = divide_q(y, x > UINT32_C(0xFFFF7FFF) ? 0xFFFFU : (uint16_t)((x + 0x8000U) >> 16));
    u = mulu16_q(slope, slope);
    *squared = u;
    /* atan(s) / s - 1 / 8 in 2^-19 turns */
    p = (uint16_t)(4393U - mulu16_q(978, u));
    p = (uint16_t)(9715U - mulu16_q(p, u));
    p = (uint16_t)(16150U - mulu16_q(p, u));
    p = (uint16_t)(27755U - mulu16_q(p, u));
    p = (uint16_t)(17905U - mulu16_q(p, u));
    /* (2^16 + p) slope / 8, halved first so that the sum fits */
    return ((((uint32_t)slope << 16) >> 1) + (((uint32_t)slope * p) >> 1)) >> 2;
}

/* |x| of all 32 bits. */
static uint32_t magnitude(int32_t x)
{
    return x < 0 ? UINT32_C(0) - (uint32_t)x : (uint32_t)x;
}

/* As polar_q32, with the larger coordinate and the square of the quotient instead of the length. */
static uint32_t direction(int32_t y, int32_t x, uint32_t *larger, uint16_t *squared)
{
    uint32_t up = magnitude(y);
    uint32_t along = magnitude(x);
    uint32_t angle;

    *squared = 0;
    *larger = up > along ? up : along;
    if (*larger == 0) {
        return 0;
    }
    if (up > along) {
        angle = UINT32_C(0x40000000) - octant(along, up, squared);
    } else {
        angle = octant(up, along, squared);
    }
    if (x < 0) {
        angle = UINT32_C(0x80000000) - angle;
    }
    return y < 0 ? UINT32_C(0) - angle : angle;
}

uint32_t atan2_q32(int32_t y, int32_t x)
{
    uint32_t larger;
    uint16_t squared;

    return direction(y, x, &larger, &squared);
}

/* To the nearest 2^-16 of a turn. */
static int16_t rounded(uint32_t angle)
{
    return (int16_t)(uint16_t)((angle + UINT32_C(0x8000)) >> 16);
}

int16_t atan2_q(int32_t y, int32_t x)
{
    return rounded(atan2_q32(y, x));
}

uint32_t polar_q32(int32_t y, int32_t x, uint32_t *length)
{
    uint32_t larger;
    uint16_t u;
    uint32_t angle = direction(y, x, &larger, &u);
    uint16_t p; /* (sqrt(1 + u) - 1) / u, Q16 */

    p = (uint16_t)(3012U - mulu16_q(712, u));
    p = (uint16_t)(7896U - mulu16_q(p, u));
    p = (uint16_t)(32742U - mulu16_q(p, u));
    p = mulu16_q(p, u);
    *length = larger + (larger >> 16) * p + (((larger & UINT32_C(0xFFFF)) * p + UINT32_C(0x8000)) >> 16);
    return angle;
}

int16_t asin_q(int32_t sine)
{
    const uint32_t one = UINT32_C(1) << 30;
    uint32_t size = magnitude(sine);
    uint32_t rest = one - size; /* 1 - |sine|, Q30 and up */
    uint8_t halvings = 0;
    uint32_t square; /* of the cosine */
    uint16_t root;

    if (size >= one) {
        return sine < 0 ? -16384 : 16384;
    }
    while (rest < UINT32_C(0x10000000)) {
        rest <<= 2;
        halvings++;
    }
    square = (uint32_t)mul32_q((int32_t)rest, (int32_t)(one + size));
    root = sqrt_q(square);
    /* Newton's step, without its half: Q15 and up */
    return atan2_q(sine, (int32_t)((root + (uint32_t)divide_q(square, root)) << (15U - halvings)));
}

int32_t cosine_q(uint32_t square, uint16_t *shortage)
{
    const uint16_t u = (uint16_t)(square >> 16);
    const uint16_t u2 = mulu16_q(u, u);
    const uint16_t u3 = mulu16_q(u2, u);

    *shortage = (uint16_t)(mulu16_q(u, 43691U) - mulu16_q(u2, 2185U) + mulu16_q(u3, 51U));
    return (int32_t)(UINT32_C(0x40000000) - (square >> 3) + (((uint32_t)u2 * 2731U - (uint32_t)u3 * 91U) >> 2));
}

void sincos_q(uint32_t angle, int32_t *sine, int32_t *cosine)
{
    const uint32_t ahead = angle + UINT32_C(0x20000000); /* by 45 deg */
    const uint8_t quarter = (uint8_t)((uint8_t)(ahead >> 24) >> 6);
    const int32_t rest = (int32_t)(ahead & UINT32_C(0x3FFFFFFF)) - INT32_C(0x20000000); /* +-45 deg */
    const int32_t x = mul32_q(rest * 4, INT32_C(1686629713)); /* rad, Q30 */
    uint16_t shortage;
    const int32_t c = cosine_q((uint32_t)mul32_q(x, x) << 4, &shortage);
    const int32_t s = shortened_q(x, shortage);

    *sine = (quarter & 1U) != 0 ? c : s;
    *cosine = (quarter & 1U) != 0 ? s : c;
    if ((quarter & 2U) != 0) {
        *sine = -*sine;
    }
    if (quarter == 1U || quarter == 2U) {
        *cosine = -*cosine;
    }
}

void angles_q(const int32_t world_q_body[4], int16_t roll_pitch_yaw[3])
{
    /* halves, so that sums of four products fit whatever the quaternion: Q29, products Q26 */
    const int32_t w = world_q_body[0] >> 1;
    const int32_t x = world_q_body[1] >> 1;
    const int32_t y = world_q_body[2] >> 1;
    const int32_t z = world_q_body[3] >> 1;
    const int32_t ww = mul32_q(w, w);
    const int32_t xx = mul32_q(x, x);
    const int32_t yy = mul32_q(y, y);
    const int32_t zz = mul32_q(z, z);
    uint32_t cosine; /* of the pitch */

    roll_pitch_yaw[2] = atan2_q(2 * (mul32_q(w, z) + mul32_q(x, y)), ww + xx - yy - zz);
    roll_pitch_yaw[0] =
        rounded(polar_q32(2 * (mul32_q(w, x) + mul32_q(y, z)), ww - xx - yy + zz, &cosine));
    roll_pitch_yaw[1] = atan2_q(2 * (mul32_q(w, y) - mul32_q(x, z)), (int32_t)cosine);
}
