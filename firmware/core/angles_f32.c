#include "angles_f32.h"

#include <math.h>

#include "trig_f32.h"

void angles_f32(const float world_q_body[4], float roll_pitch_yaw[3])
{
    const float w = world_q_body[0], x = world_q_body[1], y = world_q_body[2], z = world_q_body[3];
    const float ww = w * w, xx = x * x, yy = y * y, zz = z * z;
    const float level = ww - xx - yy + zz, tilted = 2.0f * (w * x + y * z);
    roll_pitch_yaw[0] = atan2_f32(tilted, level);
    roll_pitch_yaw[1] = atan2_f32(2.0f * (w * y - z * x), sqrtf(level * level + tilted * tilted));
    roll_pitch_yaw[2] = atan2_f32(2.0f * (w * z + x * y), ww + xx - yy - zz);
}

void attitude_from_angles_f32(const float roll_pitch_yaw[3], float world_q_body[4])
{
    float cr, sr, cp, sp, cy, sy;
    sin_cos_f32(0.5f * roll_pitch_yaw[0], &sr, &cr);
    sin_cos_f32(0.5f * roll_pitch_yaw[1], &sp, &cp);
    sin_cos_f32(0.5f * roll_pitch_yaw[2], &sy, &cy);
    world_q_body[0] = cr * cp * cy + sr * sp * sy;
    world_q_body[1] = sr * cp * cy - cr * sp * sy;
    world_q_body[2] = cr * sp * cy + sr * cp * sy;
    world_q_body[3] = cr * cp * sy - sr * sp * cy;
}
