/* Rotations in fixed point, see turning_q.h. */
#include "turning_q.h"

#include "fixed_q.h"

#define ONE_Q28 0x10000000L

void rows_q(const int32_t q[4], struct rows_q *rows)
{
    const int16_t w = high16_q(q[0]); /* Q14; products are Q28 */
    const int16_t x = high16_q(q[1]);
    const int16_t y = high16_q(q[2]);
    const int16_t z = high16_q(q[3]);
    const int32_t ww = mul16_q(w, w);
    const int32_t xx = mul16_q(x, x);
    const int32_t yy = mul16_q(y, y);
    const int32_t zz = mul16_q(z, z);
    const int32_t xy = mul16_q(x, y);
    const int32_t wz = mul16_q(w, z);
    rows->east[0] = high16_q(up_q(plus_q(minus_q(ww, zz), minus_q(xx, yy)), 2));
    rows->east[1] = high16_q(up_q(minus_q(xy, wz), 3));
    rows->east[2] = high16_q(up_q(plus_q(mul16_q(x, z), mul16_q(w, y)), 3));
    rows->north[0] = high16_q(up_q(plus_q(xy, wz), 3));
    rows->north[1] = high16_q(up_q(minus_q(minus_q(ww, zz), minus_q(xx, yy)), 2));
    rows->north[2] = high16_q(up_q(minus_q(mul16_q(y, z), mul16_q(w, x)), 3));
    const int32_t missing = minus_q(minus_q(minus_q(minus_q(ONE_Q28, ww), xx), yy), zz);
    rows->short_of = (int16_t)(plus_q(missing, 0x1000) >> 13);
}

static int32_t dot(const int16_t a[3], const int16_t b[3])
{
    return plus_q(plus_q(mul16_q(a[0], b[0]), mul16_q(a[1], b[1])), mul16_q(a[2], b[2]));
}

uint8_t level_q(const struct rows_q *rows, const int16_t a[3], int16_t east_north[2])
{
    int16_t scaled[3];
    uint16_t largest = 1;
    uint32_t squared = 0;
    if ((a[0] | a[1] | a[2]) == 0) {
        return 0;
    }
    for (uint8_t i = 0; i < 3; i++) {
        scaled[i] = a[i];
        largest |= (uint16_t)(a[i] < 0 ? ~a[i] : a[i]);
    }
    while (largest < 0x4000U) { /* only the direction counts: use all bits */
        largest = (uint16_t)(largest << 1);
        for (uint8_t i = 0; i < 3; i++) {
            scaled[i] = (int16_t)(2 * scaled[i]);
        }
    }
    for (uint8_t i = 0; i < 3; i++) {
        squared += (uint32_t)mul16_q(scaled[i], scaled[i]);
    }
    const uint8_t doubled = squared < 0x40000000UL;
    const uint16_t inverse = inverse_sqrt_q(doubled ? squared << 2 : squared);
    const int16_t east = high16_q(up_q(dot(rows->east, scaled), 1));
    const int16_t north = high16_q(up_q(dot(rows->north, scaled), 1));
    east_north[0] = high16_q(up_q(mul16u_q(east, inverse), doubled));
    east_north[1] = high16_q(up_q(mul16u_q(north, inverse), doubled));
    return 1;
}

uint16_t length_q(int16_t a, int16_t b)
{
    uint16_t longer = (uint16_t)(a < 0 ? -(int32_t)a : a);
    uint16_t shorter = (uint16_t)(b < 0 ? -(int32_t)b : b);
    if (longer < shorter) {
        const uint16_t swapped = longer;
        longer = shorter;
        shorter = swapped;
    }
    const uint16_t flat = (uint16_t)((254UL * longer + 49UL * shorter) >> 8);
    const uint16_t steep = (uint16_t)((214UL * longer + 145UL * shorter) >> 8);
    return flat > steep ? flat : steep;
}

void back_q(const struct rows_q *rows, const int16_t east_north[2], int16_t e[3])
{
    for (uint8_t i = 0; i < 3; i++) {
        const int32_t east = mul16_q(rows->east[i], east_north[0]);
        e[i] = high16_q(up_q(plus_q(east, mul16_q(rows->north[i], east_north[1])), 2));
    }
}

/* q (x) (1, h), then times 1 + longer; h and longer Q16: products of Q14 and Q16 are Q30. */
static void turn(int32_t q[4], const int16_t h[3], int16_t longer)
{
    const int16_t w = high16_q(q[0]);
    const int16_t x = high16_q(q[1]);
    const int16_t y = high16_q(q[2]);
    const int16_t z = high16_q(q[3]);
    q[0] = minus_q(minus_q(minus_q(q[0], mul16_q(x, h[0])), mul16_q(y, h[1])), mul16_q(z, h[2]));
    q[1] = minus_q(plus_q(plus_q(q[1], mul16_q(w, h[0])), mul16_q(y, h[2])), mul16_q(z, h[1]));
    q[2] = minus_q(plus_q(plus_q(q[2], mul16_q(w, h[1])), mul16_q(z, h[0])), mul16_q(x, h[2]));
    q[3] = minus_q(plus_q(plus_q(q[3], mul16_q(w, h[2])), mul16_q(x, h[1])), mul16_q(y, h[0]));
    for (uint8_t i = 0; i < 4; i++) {
        q[i] = plus_q(q[i], mul16_q(high16_q(q[i]), longer));
    }
}

void turn_q(int32_t q[4], const int32_t half[3], uint8_t left[3], int16_t short_of)
{
    int16_t h[3];
    uint32_t squared = 0; /* Q32 */
    for (uint8_t i = 0; i < 3; i++) {
        h[i] = high16_q(half[i]);
        squared += (uint32_t)mul16_q(h[i], h[i]);
    }
    const uint16_t third = (uint16_t)(((squared >> 16) * 21845U + 0x8000U) >> 16); /* |h|^2 / 3, Q16 */
    for (uint8_t i = 0; i < 3; i++) {
        uint32_t turned = (uint32_t)half[i] + (uint32_t)mul16u_q(h[i], third) + ((uint32_t)left[i] << 8);
        turned += 0x80U;
        h[i] = (int16_t)(turned >> 16);
        left[i] = (uint8_t)(turned >> 8);
    }
    turn(q, h, (int16_t)(short_of - (int16_t)(squared >> 17)));
}


