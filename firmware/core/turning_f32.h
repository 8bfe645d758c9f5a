/* What the float filters do to a quaternion: rows of its rotation, a turn, north, a first attitude.
 *
 * Source: the operations of sequential/attitude/turning_kernel.py in single precision, without its sines and
 * cosines.  Everything is by value and inlined, so that it stays in registers; the cost is in the filters'.
 *
 * What it does with bad input: `level_f32` gives the identity for a specific force that is not usable; the
 * rest takes what the filters have tested.
 */
#ifndef FACTORLAB_TURNING_F32_H
#define FACTORLAB_TURNING_F32_H

#include <math.h>

#include "vector_f32.h"

#ifdef __cplusplus
extern "C" {
#endif

struct quaternion_f32 {
    float w, x, y, z; /* 1 */
};

/* Rows of the rotation matrix from body to world, halved: those that give east and north of a body vector. */
struct level_rows_f32 {
    struct vector_f32 east, north; /* 1/2 */
};

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

/* q (w, v) for w and v of the body frame, normalised. */
INLINE_F32 struct quaternion_f32 multiplied_f32(struct quaternion_f32 q, float w, struct vector_f32 v)
{
    struct quaternion_f32 p;
    float scale;
    p.w = w * q.w - q.x * v.x - q.y * v.y - q.z * v.z;
    p.x = w * q.x + q.w * v.x + q.y * v.z - q.z * v.y;
    p.y = w * q.y + q.w * v.y + q.z * v.x - q.x * v.z;
    p.z = w * q.z + q.w * v.z + q.x * v.y - q.y * v.x;
    scale = 1.0f / sqrtf(p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
    p.w *= scale;
    p.x *= scale;
    p.y *= scale;
    p.z *= scale;
    return p;
}

/* q (1, v), normalised. */
INLINE_F32 struct quaternion_f32 turned_f32(struct quaternion_f32 q, struct vector_f32 v)
{
    return multiplied_f32(q, 1.0f, v);
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
        const float across = accel.y * accel.y + accel.z * accel.z, flat = sqrtf(across);
        const float scale = 1.0f / sqrtf(squared);
        half_angle_f32(flat * scale, -accel.x * scale, &cp, &sp);
        if (usable_f32(across)) {
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
