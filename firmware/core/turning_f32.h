/* What the float filters do to vectors and to a quaternion: tests of a reading, rows of the rotation, a turn.
 *
 * Source: the operations of sequential/attitude/turning_kernel.py in single precision.  Everything is
 * `static inline` and by value, so that it stays in the registers of an FPU; the cost is in the filters'.
 *
 * What it does with bad input: `usable_f32` is the one test of a vector.  It takes the square of its length
 * and answers no for NaN, infinity and zero, and for lengths whose square is not a normal number of single
 * precision (below 1.1e-19 or above 1.8e19, in any unit: no sensor reads that).
 */
#ifndef FACTORLAB_TURNING_F32_H
#define FACTORLAB_TURNING_F32_H

#include <math.h>
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

struct quaternion_f32 {
    float w, x, y, z; /* 1 */
};

/* Rows of the rotation matrix from body to world, halved: those that give east and north of a body vector. */
struct level_rows_f32 {
    struct vector_f32 east, north; /* 1/2 */
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

INLINE_F32 struct quaternion_f32 load_quaternion_f32(const float q[4])
{
    const struct quaternion_f32 own = {q[0], q[1], q[2], q[3]};
    return own;
}

INLINE_F32 void store_quaternion_f32(float out[4], struct quaternion_f32 q)
{
    out[0] = q.w;
    out[1] = q.x;
    out[2] = q.y;
    out[3] = q.z;
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

/* Whether |x| < a bound; no for NaN.  Of integers, as the flags of an FPU are slow to come by. */
INLINE_F32 int below_f32(float x, uint32_t bound)
{
    return (uint32_t)(bits_f32(x) << 1) < bound;
}

/* Whether all of a vector is finite, and its sum too. */
INLINE_F32 int finite_f32(struct vector_f32 v)
{
    return below_f32(v.x + v.y + v.z, UINT32_C(0xFF000000));
}

/* Whether u is nearer to v than a bound on every axis. */
INLINE_F32 int near_f32(struct vector_f32 u, struct vector_f32 v, uint32_t bound)
{
    return below_f32(u.x - v.x, bound) && below_f32(u.y - v.y, bound) && below_f32(u.z - v.z, bound);
}

/* Whether a time step is one to integrate over: 0 <= dt <= 1 s, and no NaN. */
INLINE_F32 int steady_f32(float dt)
{
    return bits_f32(dt) <= UINT32_C(0x3F800000);
}

INLINE_F32 struct level_rows_f32 level_rows_f32(struct quaternion_f32 q)
{
    const float xy = q.x * q.y;
    struct level_rows_f32 rows;
    rows.east.x = 0.5f - q.y * q.y - q.z * q.z;
    rows.east.y = xy - q.w * q.z;
    rows.east.z = q.x * q.z + q.w * q.y;
    rows.north.x = xy + q.w * q.z;
    rows.north.y = 0.5f - q.x * q.x - q.z * q.z;
    rows.north.z = q.y * q.z - q.w * q.x;
    return rows;
}

/* The vertical in the body frame, halved: third row of the rotation matrix. */
INLINE_F32 struct vector_f32 half_up_f32(struct quaternion_f32 q)
{
    return vector_f32(q.x * q.z - q.w * q.y, q.w * q.x + q.y * q.z, 0.5f - q.x * q.x - q.y * q.y);
}

/* q (1, v) for v of the body frame, normalised. */
INLINE_F32 struct quaternion_f32 turned_f32(struct quaternion_f32 q, struct vector_f32 v)
{
    struct quaternion_f32 p;
    float scale;
    p.w = q.w - q.x * v.x - q.y * v.y - q.z * v.z;
    p.x = q.x + q.w * v.x + q.y * v.z - q.z * v.y;
    p.y = q.y + q.w * v.y + q.z * v.x - q.x * v.z;
    p.z = q.z + q.w * v.z + q.x * v.y - q.y * v.x;
    scale = 1.0f / sqrtf(p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
    p.w *= scale;
    p.x *= scale;
    p.y *= scale;
    p.z *= scale;
    return p;
}

/* q turned about the vertical, so that the horizontal unit vector (east, north) points north. */
INLINE_F32 struct quaternion_f32 north_set_f32(struct quaternion_f32 q, float east, float north)
{
    float c = 1.0f + north, d = east; /* half of the angle, by the sum of both directions */
    const float squared = c * c + d * d;
    struct quaternion_f32 p;
    if (squared < 1e-12f) {
        c = 0.0f;
        d = 1.0f;
    } else {
        const float scale = 1.0f / sqrtf(squared);
        c *= scale;
        d *= scale;
    }
    p.w = c * q.w - d * q.z;
    p.x = c * q.x - d * q.y;
    p.y = c * q.y + d * q.x;
    p.z = c * q.z + d * q.w;
    return p;
}

/* Cosine and sine of half an angle in [-pi, pi] of which both are known; neither loses digits. */
INLINE_F32 void half_angle_f32(float cosine, float sine, float *half_cosine, float *half_sine)
{
    if (cosine >= 0.0f) {
        *half_cosine = sqrtf(0.5f + 0.5f * cosine);
        *half_sine = 0.5f * sine / *half_cosine;
    } else {
        const float across = sqrtf(0.5f - 0.5f * cosine);
        *half_sine = sine < 0.0f ? -across : across;
        *half_cosine = 0.5f * sine / *half_sine;
    }
}

/* The attitude of yaw 0 in which the specific force points up; the identity for a bad one. */
INLINE_F32 struct quaternion_f32 level_f32(struct vector_f32 accel)
{
    const float squared = dot_f32(accel, accel);
    struct quaternion_f32 q;
    float cr = 1.0f, sr = 0.0f, cp = 1.0f, sp = 0.0f;
    if (usable_f32(squared)) {
        const float flat = sqrtf(accel.y * accel.y + accel.z * accel.z);
        const float scale = 1.0f / sqrtf(squared);
        half_angle_f32(flat * scale, -accel.x * scale, &cp, &sp);
        if (flat > 0.0f) {
            half_angle_f32(accel.z / flat, accel.y / flat, &cr, &sr);
        }
    }
    q.w = cr * cp;
    q.x = sr * cp;
    q.y = cr * sp;
    q.z = -sr * sp;
    return q;
}

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_TURNING_F32_H */
