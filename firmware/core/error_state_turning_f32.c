/* Quaternions of the error-state filter. */
#include "error_state_parts_f32.h"

void error_state_f32_multiply(const float p[4], const float q[4], float out[4])
{
    const float a = p[0], b = p[1], c = p[2], d = p[3], w = q[0], x = q[1], y = q[2], z = q[3];
    out[0] = a * w - b * x - c * y - d * z;
    out[1] = a * x + b * w + c * z - d * y;
    out[2] = a * y - b * z + c * w + d * x;
    out[3] = a * z + b * y - c * x + d * w;
}

void error_state_f32_normalise(float *values, int n)
{
    float squared = 0.0f, scale;
    int i;
    for (i = 0; i < n; i++) {
        squared += values[i] * values[i];
    }
    scale = 1.0f / sqrtf(squared);
    for (i = 0; i < n; i++) {
        values[i] *= scale;
    }
}

/* Of a value that the compiler does not know: for zeros it would call memset, which takes 4 times as long. */
void error_state_f32_fill(float *values, int n, float value)
{
    while (n-- > 0) {
        *values++ = value;
    }
}

void error_state_f32_rotation(const float turn[4], float matrix[9])
{
    const struct quaternion_f32 q = load_quaternion_f32(turn);
    const float w2 = 2.0f * q.w, x2 = 2.0f * q.x, y2 = 2.0f * q.y, z2 = 2.0f * q.z;
    const float xx = x2 * q.x, yy = y2 * q.y, zz = z2 * q.z, xy = x2 * q.y, xz = x2 * q.z, yz = y2 * q.z;
    const float wx = w2 * q.x, wy = w2 * q.y, wz = w2 * q.z;
    matrix[0] = 1.0f - (yy + zz);
    matrix[1] = xy - wz;
    matrix[2] = xz + wy;
    matrix[3] = xy + wz;
    matrix[4] = 1.0f - (xx + zz);
    matrix[5] = yz - wx;
    matrix[6] = xz - wy;
    matrix[7] = yz + wx;
    matrix[8] = 1.0f - (xx + yy);
}

void error_state_f32_add_turned(float sum[3], const float m[9], const float v[3])
{
    const float x = v[0], y = v[1], z = v[2];
    int i;
    for (i = 0; i < 3; i++) {
        *sum++ += m[0] * x + m[1] * y + m[2] * z;
        m += 3;
    }
}

SELDOM_F32
void error_state_f32_lean(float turn[4], float c, float x, float y)
{
    float by[4];
    by[0] = c;
    by[1] = x;
    by[2] = y;
    by[3] = 0.0f;
    error_state_f32_multiply(by, turn, turn);
    error_state_f32_normalise(turn, 4);
}

/* A force that points straight down is turned over any axis. */
SELDOM_F32
void error_state_f32_lean_upright(float turn[4], const float force[3])
{
    const float across = force[0] * force[0] + force[1] * force[1];
    const float length = sqrtf(across + force[2] * force[2]), sum = length + force[2];
    if (across > 1e-12f * length * length || force[2] > 0.0f) {
        error_state_f32_lean(turn, sum, force[1], -force[0]);
    } else {
        error_state_f32_lean(turn, 0.0f, 1.0f, 0.0f);
    }
}

/* Cosine and sine of half of the angle of (x, y), which is 0 for none; to 1 mrad close to half a turn. */
SELDOM_F32
void error_state_f32_half_angle(float x, float y, float half[2])
{
    const float length = sqrtf(x * x + y * y);
    half[0] = length > 0.0f ? length + x : 1.0f;
    half[1] = half[0] > 0.0f ? y : 1.0f;
    error_state_f32_normalise(half, 2);
}
