#include "sensor.h"

#include <string.h>

#include "../../app/board.h"
#include "../../app/mpu6050.h"

#define REGISTERS 128U
#define FIRST_COUNT 0x3BU
#define POWER 0x6BU
#define POWER_RESET 0x80U
#define POWER_SLEEP 0x40U
#define IDENTITY 0x75U
#define BLOCK 256U /* rows */

struct recorded {
    recorded_reader *reader;
    struct recorded_row rows[BLOCK];
    size_t held, next;            /* rows in the block; the present one stands before `next` */
    int32_t row;                  /* number of the present row, -1 before the first burst */
    uint8_t registers[REGISTERS]; /* of the sensor */
};

static struct recorded recorded;

static void reset(void)
{
    (void)memset(recorded.registers, 0, sizeof recorded.registers);
    recorded.registers[POWER] = POWER_SLEEP;
    recorded.registers[IDENTITY] = MPU6050_WHO_AM_I;
}

static const struct recorded_row *present(void)
{
    return &recorded.rows[recorded.next - 1U];
}

/* The next row; 0 at the end. */
static int advance(void)
{
    if (recorded.next == recorded.held) {
        recorded.held = recorded.reader(recorded.rows, BLOCK);
        recorded.next = 0;
        if (recorded.held == 0U) {
            return 0;
        }
    }
    recorded.next++;
    recorded.row++;
    return 1;
}

void recorded_start(recorded_reader *reader)
{
    (void)memset(&recorded, 0, sizeof recorded);
    recorded.reader = reader;
    recorded.row = -1;
    reset();
}

int recorded_tick(void)
{
    return recorded.row < 0 || advance() != 0;
}

int32_t recorded_row(void)
{
    return recorded.row;
}

uint8_t recorded_command(void)
{
    return recorded.row < 0 ? 0U : present()->command;
}

static void write_registers(const uint8_t *bytes, uint8_t length)
{
    for (uint8_t k = 1; k < length; k++) {
        recorded.registers[bytes[0] + k - 1U] = bytes[k];
        if (bytes[0] + k - 1U == POWER && (bytes[k] & POWER_RESET) != 0U) {
            reset();
        }
    }
}

/* The counts of the present row, big endian, where the sensor is awake. */
static void measure(void)
{
    uint8_t *bytes = &recorded.registers[FIRST_COUNT];
    if ((recorded.registers[POWER] & POWER_SLEEP) != 0U) {
        return;
    }
    for (uint8_t k = 0; k < MPU6050_COUNTS; k++) {
        const uint16_t counts = (uint16_t)present()->counts[k];
        bytes[2U * k] = (uint8_t)(counts >> 8);
        bytes[2U * k + 1U] = (uint8_t)(counts & 0xFFU);
    }
}

static uint8_t answer(void)
{
    static const uint8_t states[] = {
        [RECORDED_ANSWERS] = BOARD_I2C_DONE,
        [RECORDED_SILENT] = BOARD_I2C_NO_ANSWER,
        [RECORDED_HANGS] = BOARD_I2C_BUSY,
        [RECORDED_FAULT] = BOARD_I2C_FAULT,
    };
    return recorded.row < 0 ? BOARD_I2C_DONE : states[present()->answer & 3U];
}

uint8_t recorded_transfer(uint8_t address, const uint8_t *write, uint8_t write_length, uint8_t *read,
                          uint8_t read_length)
{
    const uint8_t first = write[0];
    if (address != MPU6050_ADDRESS || first + (write_length - 1U) > REGISTERS ||
        first + read_length > REGISTERS) {
        return BOARD_I2C_NO_ANSWER;
    }
    if (first == FIRST_COUNT && read_length > 0U && recorded.row < 0 && advance() == 0) {
        return BOARD_I2C_NO_ANSWER;
    }
    if (answer() != BOARD_I2C_DONE) {
        return answer();
    }
    write_registers(write, write_length);
    if (read_length > 0U) {
        if (recorded.row >= 0) {
            measure();
        }
        (void)memcpy(read, &recorded.registers[first], read_length);
    }
    return BOARD_I2C_DONE;
}
