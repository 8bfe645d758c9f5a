#include "mpu6050.h"

#include <string.h>

#include "board.h"

/* Registers. */
#define RATE_DIVIDER 0x19U /* then low-pass 0x1A, gyro range 0x1B, accelerometer range 0x1C */
#define FIRST_COUNT 0x3BU
#define POWER 0x6BU
#define IDENTITY 0x75U

#define POWER_RESET 0x80U
#define POWER_CLOCK_GYRO_X 0x01U

enum step { RECOVER, RESET, IDENTIFY, WAKE, CONFIGURE, VERIFY, READ };

static const uint8_t configuration[] = {
    0x00U, /* rate: 1 kHz */
    0x03U, /* low-pass: accelerometer 44 Hz, gyro 42 Hz */
    0x18U, /* gyro: +-2000 deg/s */
    0x10U, /* accelerometer: +-8 g */
};

/* Writes register and `count` values that stand in the command, then reads. */
static void transfer(struct mpu6050 *sensor, uint8_t reg, uint8_t count, uint8_t read)
{
    sensor->command[0] = reg;
    board_i2c_start(MPU6050_ADDRESS, sensor->command, (uint8_t)(count + 1U), sensor->bytes, read);
}

static void restart(struct mpu6050 *sensor, uint8_t step)
{
    sensor->step = step;
    sensor->wait = step == RECOVER ? 0U : MPU6050_FAILURES;
    sensor->failures = 0;
}

void mpu6050_start(struct mpu6050 *sensor)
{
    (void)memset(sensor, 0, sizeof *sensor);
    sensor->step = RESET;
}

/* The transfer that belongs to the present step of the start. */
static void begin(struct mpu6050 *sensor)
{
    switch (sensor->step) {
    case RESET:
        sensor->command[1] = POWER_RESET;
        transfer(sensor, POWER, 1, 0);
        break;
    case IDENTIFY:
        transfer(sensor, IDENTITY, 0, 1);
        break;
    case WAKE:
        sensor->command[1] = POWER_CLOCK_GYRO_X;
        transfer(sensor, POWER, 1, 0);
        break;
    case CONFIGURE:
        (void)memcpy(sensor->command + 1, configuration, sizeof configuration);
        transfer(sensor, RATE_DIVIDER, sizeof configuration, 0);
        break;
    case VERIFY:
        transfer(sensor, RATE_DIVIDER, 0, sizeof configuration);
        break;
    default:
        sensor->known = sensor->changed = sensor->saturated = 0;
        transfer(sensor, FIRST_COUNT, 0, MPU6050_BURST);
        break;
    }
}

uint8_t mpu6050_tick(struct mpu6050 *sensor)
{
    if (board_i2c_state() == BOARD_I2C_BUSY) {
        restart(sensor, RECOVER); /* a burst takes half a millisecond: this one will never end */
    }
    if (sensor->step == RECOVER) {
        if (board_i2c_recover() != 0U) {
            restart(sensor, RESET);
        }
        return MPU6050_NOTHING;
    }
    if (sensor->wait > 0U) {
        sensor->wait--;
        return MPU6050_NOTHING;
    }
    begin(sensor);
    return MPU6050_PENDING;
}

/* One step of the start was answered. */
static void advance(struct mpu6050 *sensor)
{
    uint8_t good = 1;
    if (sensor->step == IDENTIFY) {
        sensor->identity = sensor->bytes[0];
        good = sensor->identity == MPU6050_WHO_AM_I;
    } else if (sensor->step == VERIFY) {
        good = memcmp(sensor->bytes, configuration, sizeof configuration) == 0;
    }
    if (good == 0U) {
        restart(sensor, RESET);
        return;
    }
    sensor->wait = sensor->step == RESET ? 10U : sensor->step == WAKE ? 4U : 0U; /* periods */
    sensor->step++;
}

/* A sensor that says the same again and again is started anew, every few seconds. */
static uint8_t repeated(struct mpu6050 *sensor)
{
    sensor->equal++;
    if (sensor->equal == MPU6050_STUCK || sensor->equal == UINT8_MAX) {
        restart(sensor, RESET);
        sensor->equal = MPU6050_STUCK;
    }
    return sensor->equal < MPU6050_STUCK ? MPU6050_SAMPLE : MPU6050_NOTHING;
}

/* Counts out of bytes, up to `end`: one pass, for it stands between a sample in memory and its update. */
static void decode(struct mpu6050 *sensor, uint8_t end)
{
    const uint8_t *bytes = sensor->bytes + 2U * sensor->known;
    int16_t *counts = sensor->counts + sensor->known;
    for (uint8_t k = sensor->known; k < end; k++) {
        int16_t count = (int16_t)(uint16_t)(((uint16_t)bytes[0] << 8) | bytes[1]);
        if (count != *counts) {
            sensor->changed = 1;
            *counts = count;
        }
        if (count == INT16_MAX || count == INT16_MIN) {
            sensor->saturated = 1;
        }
        bytes += 2;
        counts++;
    }
    sensor->known = end;
}

uint8_t mpu6050_part(struct mpu6050 *sensor)
{
    if (sensor->step != READ) {
        return 0;
    }
    decode(sensor, BOARD_PART / 2U);
    return 1;
}

static uint8_t sample(struct mpu6050 *sensor)
{
    decode(sensor, MPU6050_COUNTS);
    if (sensor->changed == 0U) {
        return repeated(sensor);
    }
    sensor->equal = 0;
    return sensor->saturated != 0U ? MPU6050_SATURATED : MPU6050_SAMPLE;
}

static uint8_t failed(struct mpu6050 *sensor, uint8_t state)
{
    if (state == BOARD_I2C_FAULT) {
        restart(sensor, RECOVER);
    } else if (sensor->step != READ) {
        restart(sensor, RESET);
    } else if (++sensor->failures >= MPU6050_FAILURES) {
        restart(sensor, RESET);
        sensor->wait = 0;
    }
    return MPU6050_NOTHING;
}

uint8_t mpu6050_transferred(struct mpu6050 *sensor)
{
    uint8_t state = board_i2c_state();
    if (state != BOARD_I2C_DONE) {
        return failed(sensor, state);
    }
    sensor->failures = 0;
    if (sensor->step != READ) {
        advance(sensor);
        return MPU6050_NOTHING;
    }
    return sample(sensor);
}
