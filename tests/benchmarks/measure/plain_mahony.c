/* The textbook's Mahony filter in single precision, 6-D: what the C core is compared with in speed.
 *
 * Two gains, Euler's step, nothing limited or rejected, no rest: as short as the filter gets.
 */
#include <math.h>

void plain_mahony(long count, double dt, const double *gyro, const double *accel, double *path)
{
    const float kp = 0.5f, ki = 0.0005f, step = (float)dt;
    float q0 = 1.0f, q1 = 0.0f, q2 = 0.0f, q3 = 0.0f, bx = 0.0f, by = 0.0f, bz = 0.0f;
    for (long k = 0; k < count; k++) {
        const float ax = (float)accel[3 * k], ay = (float)accel[3 * k + 1], az = (float)accel[3 * k + 2];
        const float force = ax * ax + ay * ay + az * az;
        float x = (float)gyro[3 * k], y = (float)gyro[3 * k + 1], z = (float)gyro[3 * k + 2];
        if (force > 0.0f) {
            const float inverse = 1.0f / sqrtf(force);
            const float vx = 2.0f * (q1 * q3 - q0 * q2), vy = 2.0f * (q0 * q1 + q2 * q3);
            const float vz = 1.0f - 2.0f * (q1 * q1 + q2 * q2);
            const float ex = (ay * vz - az * vy) * inverse, ey = (az * vx - ax * vz) * inverse;
            const float ez = (ax * vy - ay * vx) * inverse;
            bx -= ki * ex * step;
            by -= ki * ey * step;
            bz -= ki * ez * step;
            x += kp * ex - bx;
            y += kp * ey - by;
            z += kp * ez - bz;
        }
        x *= 0.5f * step;
        y *= 0.5f * step;
        z *= 0.5f * step;
        const float a = q0 - q1 * x - q2 * y - q3 * z, b = q1 + q0 * x + q2 * z - q3 * y;
        const float c = q2 + q0 * y - q1 * z + q3 * x, d = q3 + q0 * z + q1 * y - q2 * x;
        const float length = 1.0f / sqrtf(a * a + b * b + c * c + d * d);
        q0 = a * length;
        q1 = b * length;
        q2 = c * length;
        q3 = d * length;
        path[4 * k] = (double)q0;
        path[4 * k + 1] = (double)q1;
        path[4 * k + 2] = (double)q2;
        path[4 * k + 3] = (double)q3;
    }
}
