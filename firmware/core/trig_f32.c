#include "trig_f32.h"

#include <math.h>
#include <stdint.h>

#define FARTHEST 1e4f /* rad */

/* The nearest whole number of units, for a finite ratio within +-2^23. */
static int32_t nearest(float ratio)
{
    return (int32_t)(ratio + (ratio < 0.0f ? -0.5f : 0.5f));
}

static float within_reach(float angle)
{
    return angle > FARTHEST || angle < -FARTHEST ? 0.0f : angle;
}

/* Minus n times a quarter turn, in three parts of which the first two times n are exact. */
static float less_quarters(float angle, int32_t n)
{
    const float turns = (float)n;
    return ((angle - turns * 1.5703125f) - turns * 4.83751297e-4f) - turns * 7.54979013e-8f;
}

float atan2_f32(float y, float x)
{
    const float ax = x < 0.0f ? -x : x, ay = y < 0.0f ? -y : y;
    const float larger = ax > ay ? ax : ay, smaller = ax > ay ? ay : ax;
    if (larger == 0.0f) {
        return 0.0f;
    }
    const float t = smaller / larger, u = t * t;
    float p = 0.00302341697f;
    p = p * u - 0.016824102f;
    p = p * u + 0.0440455303f;
    p = p * u - 0.0763279945f;
    p = p * u + 0.107099816f;
    p = p * u - 0.142243758f;
    p = p * u + 0.199957922f;
    p = p * u - 0.333332658f;
    p = t + t * u * p;
    p = ay > ax ? 0.5f * PI_F32 - p : p;
    p = x < 0.0f ? PI_F32 - p : p;
    return y < 0.0f ? -p : p;
}

void sin_cos_f32(float angle, float *sine, float *cosine)
{
    if (!(angle * 0.0f == 0.0f)) {
        *sine = *cosine = NAN;
        return;
    }
    const float near = within_reach(angle);
    const int32_t n = nearest(near * 0.636619772f);
    const float r = less_quarters(near, n), u = r * r;
    const float s = r + r * u * (-0.166666374f + u * (0.00833157636f - u * 0.00019459847f));
    const float c = 1.0f - u * (0.5f - u * (0.041666612f - u * (0.00138865272f - u * 2.43715222e-05f)));
    const uint32_t quarter = (uint32_t)n & 3U;
    const float first = (quarter & 1U) != 0U ? c : s, second = (quarter & 1U) != 0U ? s : c;
    *sine = quarter >= 2U ? -first : first;
    *cosine = quarter == 1U || quarter == 2U ? -second : second;
}

float wrapped_f32(float angle)
{
    if (angle <= PI_F32 && angle >= -PI_F32) {
        return angle;
    }
    if (!(angle * 0.0f == 0.0f)) {
        return NAN;
    }
    const float near = within_reach(angle);
    return less_quarters(near, 4 * nearest(near * 0.159154943f));
}

float decay_f32(float x)
{
    float part = x > 20.0f ? 20.0f : x, share;
    int doublings = 0;
    while (part > 0.5f) {
        part *= 0.5f;
        doublings++;
    }
    share = -0.00111193571f;
    share = share * part + 0.00817461498f;
    share = share * part - 0.0416231044f;
    share = share * part + 0.166661069f;
    share = share * part - 0.499999732f;
    share = part + part * part * share;
    while (doublings > 0) {
        share *= 2.0f - share; /* 1 - exp(-2x) */
        doublings--;
    }
    return share;
}
