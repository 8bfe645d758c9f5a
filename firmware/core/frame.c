#include "frame.h"

#include "crc16.h"

#define HEADER 9U /* bytes before the payload */

static uint8_t *put16(uint8_t *to, uint16_t value)
{
    to[0] = (uint8_t)value;
    to[1] = (uint8_t)(value >> 8);
    return to + 2;
}

static uint8_t *put32(uint8_t *to, uint32_t value)
{
    return put16(put16(to, (uint16_t)value), (uint16_t)(value >> 16));
}

static uint8_t *begin(uint8_t *out, uint8_t type, uint16_t sequence, uint32_t t_us)
{
    out[0] = FRAME_START;
    out[1] = type;
    return put32(put16(out + 3, sequence), t_us);
}

/* Writes length and check, now that the payload stands; returns the bytes of the whole frame. */
static uint8_t finish(uint8_t *out, const uint8_t *end)
{
    uint8_t before_check = (uint8_t)(end - out);
    out[2] = (uint8_t)(before_check - HEADER);
    (void)put16(out + before_check, crc16(CRC16_START, out + 1, (uint8_t)(before_check - 1U)));
    return (uint8_t)(before_check + 2U);
}

/* The nearest multiple of 2^16, as the upper half: Q30 to Q14 without a shift. */
static int16_t upper_half(int32_t value)
{
    int16_t upper = (int16_t)(value >> 16);
    if (((uint16_t)value & 0x8000U) != 0 && upper != INT16_MAX) {
        upper = (int16_t)(upper + 1);
    }
    return upper;
}

/* rad/s, Q24 to Q15: by 8 bits, which is a move, then by one with rounding; saturates at +-1 rad/s. */
static uint8_t *put_bias(uint8_t *to, const int32_t bias[3])
{
    for (uint8_t k = 0; k < 3; k++) {
        int32_t value = ((bias[k] >> 8) + 1) >> 1;
        value = value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : value;
        to = put16(to, (uint16_t)value);
    }
    return to;
}

static uint8_t *put_counts(uint8_t *to, const int16_t *values, uint8_t count)
{
    for (; count > 0; count--) {
        to = put16(to, (uint16_t)*values++);
    }
    return to;
}

uint8_t frame_quaternion(uint8_t *out, uint16_t sequence, uint32_t t_us, const int32_t world_q_body[4],
                         const int32_t bias[3], uint8_t status)
{
    uint8_t *to = begin(out, FRAME_QUATERNION, sequence, t_us);
    for (uint8_t k = 0; k < 4; k++) {
        to = put16(to, (uint16_t)upper_half(world_q_body[k]));
    }
    to = put_bias(to, bias);
    *to++ = status;
    return finish(out, to);
}

uint8_t frame_angles(uint8_t *out, uint16_t sequence, uint32_t t_us, const int16_t roll_pitch_yaw[3],
                     const int32_t bias[3], uint8_t status)
{
    uint8_t *to = begin(out, FRAME_ANGLES, sequence, t_us);
    to = put_bias(put_counts(to, roll_pitch_yaw, 3), bias);
    *to++ = status;
    return finish(out, to);
}

uint8_t frame_raw(uint8_t *out, uint16_t sequence, uint32_t t_us, const int16_t counts[7], uint8_t status)
{
    uint8_t *to = put_counts(begin(out, FRAME_RAW, sequence, t_us), counts, 7);
    *to++ = status;
    return finish(out, to);
}

uint8_t frame_boot(uint8_t *out, uint16_t sequence, uint32_t t_us, const struct boot_facts *facts)
{
    uint8_t *to = begin(out, FRAME_BOOT, sequence, t_us);
    for (uint8_t k = 0; k < 3; k++) {
        *to++ = facts->version[k];
    }
    *to++ = facts->target;
    *to++ = facts->filter;
    *to++ = facts->sensor;
    to = put32(put16(to, facts->rate_hz), facts->calibration_hash);
    to = put16(to, facts->gyro_range_deg_s);
    *to++ = facts->accel_range_g;
    return finish(out, to);
}
