/* MPU-6050 over I2C as a state machine that never waits.
 *
 * Computes: seven counts a period: ax ay az temperature gx gy gz, read in one burst of 14 bytes, so that they
 * belong to one instant.  Ranges +-2000 deg/s and +-8 g, low-pass 42 Hz, internal rate 1 kHz: a burst finds a
 * sample that is at most 1 ms old.
 * Source: InvenSense RM-MPU-6000A-00 4.2 (registers), PS-MPU-6000A-00 3.4 (start-up 30 ms, reset 100 ms).
 * Start: reset, 100 ms, identity, clock from the gyro, 40 ms, ranges written and read back, then bursts.
 *
 * What it does with bad input:
 * - no answer: the period has no sample; after MPU6050_FAILURES periods in a row the sensor is started
 *   anew (it may have lost its power and with it its ranges).
 * - a transfer that has not ended by the next tick, or a fault on the bus: the bus is freed (nine clocks),
 *   the sensor started anew.
 * - another identity than MPU6050_WHO_AM_I, or ranges that do not read back: no sample; tried again.
 * - all 14 bytes the same MPU6050_STUCK times in a row: no such noise exists, so these are no samples until
 *   something changes; the sensor is started anew.
 * - a count at the end of its range: the sample is given, marked as saturated.
 */
#ifndef FACTORLAB_MPU6050_H
#define FACTORLAB_MPU6050_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef MPU6050_ADDRESS
#define MPU6050_ADDRESS 0x68U /* 7 bits; 0x69 with AD0 high */
#endif
#ifndef MPU6050_WHO_AM_I
#define MPU6050_WHO_AM_I 0x68U /* whatever AD0 is; many copies say 0x70, 0x72 or 0x98 */
#endif

#define MPU6050_GYRO_RANGE_DEG_S 2000U /* deg/s at 32768 counts */
#define MPU6050_ACCEL_RANGE_G 8U       /* g at 32768 counts */
#define MPU6050_FAILURES 10U           /* periods in a row */
#define MPU6050_STUCK 25U              /* equal samples in a row */
#define MPU6050_COUNTS 7U
#define MPU6050_GYRO 4U /* place of the gyro in ax ay az temperature gx gy gz */
#define MPU6050_BURST 14U /* bytes */

/* What a call tells. */
#define MPU6050_PENDING 0U   /* a transfer is under way: ask again when it has ended */
#define MPU6050_SAMPLE 1U    /* `counts` of the sensor is the sample of this period */
#define MPU6050_SATURATED 2U /* the same, and one of its counts stands at the end of the range */
#define MPU6050_NOTHING 3U   /* this period will have no sample */

struct mpu6050 {
    uint8_t step;                   /* of the start, or reading */
    uint8_t wait;                   /* periods until the next step */
    uint8_t failures;               /* periods without an answer, in a row */
    uint8_t equal;                  /* samples equal to the one before, in a row */
    uint8_t identity;               /* last WHO_AM_I read, 0: none */
    uint8_t command[5];             /* bytes being written */
    uint8_t bytes[MPU6050_BURST];   /* bytes being read, big endian */
    int16_t counts[MPU6050_COUNTS]; /* the last sample: ax ay az temperature gx gy gz */
    uint8_t known;                  /* counts of this period's sample that stand in `counts` already */
    uint8_t changed;                /* 1: one of them differs from the last sample */
    uint8_t saturated;              /* 1: one of them stands at the end of its range */
};

void mpu6050_start(struct mpu6050 *sensor);

/* To be called when a period begins: starts its transfer.  MPU6050_PENDING or MPU6050_NOTHING. */
uint8_t mpu6050_tick(struct mpu6050 *sensor);

/* May be called when BOARD_PART bytes have been read; 1: `counts` has the accelerometer. */
uint8_t mpu6050_part(struct mpu6050 *sensor);

/* To be called when a transfer has ended. */
uint8_t mpu6050_transferred(struct mpu6050 *sensor);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_MPU6050_H */
