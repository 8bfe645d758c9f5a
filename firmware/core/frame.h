/* Frames on the serial line: what the board says, 100 times a second.
 *
 * Computes: the bytes of one frame.
 *     offset  0      1     2       3         5     9        9 + length
 *             0xA5   type  length  sequence  time  payload  check
 *             u8     u8    u8      u16       u32   length   u16
 * Numbers are little endian. `length` counts the payload. The check is CRC-16/CCITT-FALSE over everything
 * after the start byte. One sequence counter runs through all frames and lines of a board, boot frames too; a
 * frame that could not be sent uses its number up, so that the other side sees the loss. `time` is the
 * board's clock when the sample was taken, us since start, modulo 2^32 (71.6 minutes).
 *
 * A start byte and a length rather than COBS: COBS writes the distance to the next zero before the data,
 * so its first byte needs the whole frame, check included; here the first byte is a constant and may leave
 * before the rest is encoded. Data may contain 0xA5; the reader finds its place by type, length and check.
 *
 * Source: own. Conversions round to nearest, ties upwards, and saturate.
 * Cost: AVR -O2, 1 070 cycles a quaternion frame, 905 an angle frame, 847 a raw one; 0.8 kB of flash.
 *
 * What it does with bad input: every encoder takes any values. Numbers outside a payload's range saturate; a
 * quaternion that is not of unit length is sent as it is; the caller's status says what was wrong with the
 * sample. NaN cannot arrive here: a float filter converts with care before (see app/). */
#ifndef FACTORLAB_FRAME_H
#define FACTORLAB_FRAME_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FRAME_START 0xA5U /* first byte of every frame; may be sent before the rest is encoded */
#define FRAME_LARGEST 32U /* bytes: no frame is longer */

/* types */
#define FRAME_QUATERNION 1U /* world_q_body: i16 w x y z, Q14; bias: i16 x y z, rad/s, Q15; status: u8 */
#define FRAME_ANGLES 2U     /* i16 roll pitch yaw, 65536 = 360 deg; bias: i16 x y z, rad/s, Q15; status */
#define FRAME_RAW 3U        /* i16 ax ay az temperature gx gy gz, counts of an MPU-6050; status: u8 */
#define FRAME_BOOT 4U       /* struct boot_facts, in its order */

/* bits of the status */
#define FRAME_REST 0x01U           /* the gyro rests: its bias is being learnt */
#define FRAME_ACCEL_REJECTED 0x02U /* the accelerometer was not used for this update */
#define FRAME_MAG_DISTURBED 0x04U  /* the magnetometer was not used for this update */
#define FRAME_SAMPLE_MISSING 0x08U /* the sensor gave no sample: raw counts are the last ones */
#define FRAME_OVERRUN 0x10U        /* frames before this one were dropped: the line was too slow */
#define FRAME_SATURATED 0x20U      /* a count of this sample stands at the end of its range */

/* commands to the board, one byte each */
#define COMMAND_QUATERNION 'q' /* send quaternion frames */
#define COMMAND_ANGLES 'a'     /* send angle frames */
#define COMMAND_RAW 'r'        /* send raw frames */
#define COMMAND_TEXT 't'       /* send lines $ATT,... (text.h) */
#define COMMAND_BOOT 'b'       /* send the boot frame once more; the mode stays */

/* targets, filters and sensors that a boot frame names */
#define BOOT_HOST 0U       /* a computer */
#define BOOT_MPS2_AN386 1U /* Cortex-M4F, emulated by QEMU */
#define BOOT_STM32F4 2U    /* Cortex-M4F */
#define BOOT_ATMEGA328P 3U /* AVR: Arduino Uno and Nano */

#define BOOT_NO_FILTER 0U
#define BOOT_COMPLEMENTARY_F32 1U
#define BOOT_TILT_F32 2U /* Kalman: angle and bias */
#define BOOT_MAHONY_F32 3U
#define BOOT_ERROR_STATE_F32 4U
#define BOOT_COMPLEMENTARY_Q 0x81U
#define BOOT_TILT_Q 0x82U
#define BOOT_MAHONY_Q 0x83U

#define BOOT_MPU6050 1U

struct boot_facts {
    uint8_t version[3];        /* of the firmware: major, minor, patch */
    uint8_t target;            /* BOOT_HOST ... */
    uint8_t filter;            /* BOOT_NO_FILTER ... */
    uint8_t sensor;            /* BOOT_MPU6050 */
    uint16_t rate_hz;          /* samples a second */
    uint32_t calibration_hash; /* first 4 bytes of the SHA-256 of the calibration file, 0: none built in */
    uint16_t gyro_range_deg_s; /* deg/s at 32768 counts */
    uint8_t accel_range_g;     /* g at 32768 counts, g = 9.80665 m/s^2 */
};

/* Each writes one frame to `out` (FRAME_LARGEST bytes are enough) and returns its length. */
uint8_t frame_quaternion(uint8_t *out, uint16_t sequence, uint32_t t_us,
                         const int32_t world_q_body[4] /* Q30 */,
                         const int32_t bias[3] /* rad/s, Q24 */, uint8_t status);
uint8_t frame_angles(uint8_t *out, uint16_t sequence, uint32_t t_us,
                     const int16_t roll_pitch_yaw[3] /* 65536 = 360 deg */,
                     const int32_t bias[3] /* rad/s, Q24 */, uint8_t status);
uint8_t frame_raw(uint8_t *out, uint16_t sequence, uint32_t t_us,
                  const int16_t counts[7] /* ax ay az temperature gx gy gz */, uint8_t status);
uint8_t frame_boot(uint8_t *out, uint16_t sequence, uint32_t t_us, const struct boot_facts *facts);

#ifdef __cplusplus
}
#endif
#endif
