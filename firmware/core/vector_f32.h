/* Vectors in single precision, and the tests of a reading.
 *
 * Source: the tests of sequential/attitude/turning_kernel.py, in integers where an FPU's flags are slow to
 * come by.  Everything is by value and inlined, so that it stays in registers; the cost is in the filters'.
 *
 * What it does with bad input: `usable_f32` is the one test of a vector.  It takes the square of its length
 * and answers no for NaN, infinity and zero, and for lengths whose square is not a normal number of single
 * precision (below 1.1e-19 or above 1.8e19, in any unit: no sensor reads that).
 */
#ifndef FACTORLAB_VECTOR_F32_H
#define FACTORLAB_VECTOR_F32_H

#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A step is one function without calls, whatever a compiler thinks of its length. */
#if defined(__GNUC__)
#define INLINE_F32 static inline __attribute__((always_inline))
#else
#define INLINE_F32 static inline
#endif

/* What hardly ever happens stays out of the way of what does. */
#if defined(__GNUC__)
#define RARELY_F32(condition) __builtin_expect(!!(condition), 0)
#else
#define RARELY_F32(condition) (condition)
#endif

struct vector_f32 {
    float x, y, z; /* any unit */
};

INLINE_F32 struct vector_f32 vector_f32(float x, float y, float z)
{
    const struct vector_f32 v = {x, y, z};
    return v;
}

INLINE_F32 struct vector_f32 load_vector_f32(const float v[3])
{
    return vector_f32(v[0], v[1], v[2]);
}

INLINE_F32 void store_vector_f32(float out[3], struct vector_f32 v)
{
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

INLINE_F32 float dot_f32(struct vector_f32 a, struct vector_f32 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

INLINE_F32 struct vector_f32 cross_f32(struct vector_f32 a, struct vector_f32 b)
{
    return vector_f32(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

INLINE_F32 struct vector_f32 scaled_f32(struct vector_f32 v, float by)
{
    return vector_f32(v.x * by, v.y * by, v.z * by);
}

/* v + u by */
INLINE_F32 struct vector_f32 plus_f32(struct vector_f32 v, struct vector_f32 u, float by)
{
    return vector_f32(v.x + u.x * by, v.y + u.y * by, v.z + u.z * by);
}

/* v - u by */
INLINE_F32 struct vector_f32 minus_f32(struct vector_f32 v, struct vector_f32 u, float by)
{
    return vector_f32(v.x - u.x * by, v.y - u.y * by, v.z - u.z * by);
}

/* v, drawn to another vector by a share. */
INLINE_F32 struct vector_f32 drawn_f32(struct vector_f32 v, struct vector_f32 to, float share)
{
    return vector_f32(v.x + (to.x - v.x) * share, v.y + (to.y - v.y) * share, v.z + (to.z - v.z) * share);
}

INLINE_F32 uint32_t bits_f32(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Whether a vector of this squared length is finite and not zero: one comparison of integers. */
INLINE_F32 int usable_f32(float squared)
{
    return bits_f32(squared) - UINT32_C(0x00800000) < UINT32_C(0x7F000000);
}

/* A bound as `below_f32` takes it, of a number that is not negative: its bits without the sign. */
INLINE_F32 uint32_t bound_f32(float limit)
{
    return (uint32_t)(bits_f32(limit) << 1);
}

/* Whether |x| < a bound; no for NaN. */
INLINE_F32 int below_f32(float x, uint32_t bound)
{
    return (uint32_t)(bits_f32(x) << 1) < bound;
}

/* Whether this is a rate that a gyro may say: of less than 8192 rad/s (470 000 deg/s), and no NaN in it. */
INLINE_F32 int is_rate_f32(struct vector_f32 gyro)
{
    return bits_f32(dot_f32(gyro, gyro)) < UINT32_C(0x4C800000);
}

/* Whether u is nearer to v than a bound on every axis. */
INLINE_F32 int near_f32(struct vector_f32 u, struct vector_f32 v, uint32_t bound)
{
    return below_f32(u.x - v.x, bound) && below_f32(u.y - v.y, bound) && below_f32(u.z - v.z, bound);
}

INLINE_F32 float clamped_f32(float x, float limit)
{
    return x > limit ? limit : (x < -limit ? -limit : x);
}

/* v with every axis within a limit, given also as its bound; it hardly ever is beyond. */
INLINE_F32 struct vector_f32 limited_f32(struct vector_f32 v, float limit, uint32_t bound)
{
    if (RARELY_F32(!(below_f32(v.x, bound) && below_f32(v.y, bound) && below_f32(v.z, bound)))) {
        return vector_f32(clamped_f32(v.x, limit), clamped_f32(v.y, limit), clamped_f32(v.z, limit));
    }
    return v;
}

/* Whether a time step is one to integrate over: 0 <= dt <= 1 s, and no NaN. */
INLINE_F32 int steady_f32(float dt)
{
    return bits_f32(dt) <= UINT32_C(0x3F800000);
}

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_VECTOR_F32_H */
