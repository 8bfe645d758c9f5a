/* The board of app/board.h on a computer: no clock, no wires; what the emulated boards are held to.
 *
 *     host ROWS BYTES [COMMAND]
 *
 * reads the rows of recorded/sensor.h, writes what the serial line would carry, and may begin with a command
 * of one letter.  A period follows the one before when nothing is left to do.
 */
#include "../../app/board.h"

#include <stdio.h>
#include <stdlib.h>

#include "../../app/app.h"
#include "../../core/frame.h"
#include "../recorded/sensor.h"

struct board {
    FILE *rows, *bytes;
    uint32_t periods; /* since the start, as the application knows them */
    uint8_t events;   /* BOARD_TICK ... */
    uint8_t transfer; /* BOARD_I2C_DONE ... */
    int16_t received; /* the one byte waiting, -1: none */
};

const uint8_t board_target = BOOT_HOST;
static struct board board = {.received = -1};

static size_t read_rows(struct recorded_row *rows, size_t count)
{
    return fread(rows, sizeof rows[0], count, board.rows);
}

static void receive(uint8_t byte)
{
    board.received = byte;
    board.events |= BOARD_RECEIVED;
}

void board_start(void)
{
    recorded_start(read_rows);
}

uint8_t board_wait(void)
{
    if (board.events == 0U) {
        board.events = BOARD_TICK;
        if (recorded_tick() == 0) {
            exit(fclose(board.bytes) == 0 ? EXIT_SUCCESS : EXIT_FAILURE);
        }
        if (recorded_command() != 0U) {
            receive(recorded_command());
        }
    }
    const uint8_t events = board.events;
    board.events = 0;
    return events;
}

uint8_t board_periods(void)
{
    board.periods++;
    return 1;
}

uint32_t board_time_us(void)
{
    return board.periods * BOARD_PERIOD_US;
}

void board_phase(uint8_t after)
{
    (void)after;
}

void board_i2c_start(uint8_t address, const uint8_t *write, uint8_t write_length, uint8_t *read,
                     uint8_t read_length)
{
    board.transfer = recorded_transfer(address, write, write_length, read, read_length);
    if (board.transfer != BOARD_I2C_BUSY) {
        board.events |= BOARD_I2C;
    }
}

uint8_t board_i2c_state(void)
{
    return board.transfer;
}

uint8_t board_i2c_recover(void)
{
    board.transfer = BOARD_I2C_DONE;
    return 1;
}

uint8_t board_write(const uint8_t *bytes, uint8_t length)
{
    return fwrite(bytes, 1, length, board.bytes) == length;
}

uint8_t board_room(void)
{
    return UINT8_MAX;
}

int16_t board_received(void)
{
    const int16_t byte = board.received;
    board.received = -1;
    return byte;
}

void board_mark_update(uint8_t level)
{
    (void)level;
}

int main(int count, char **arguments)
{
    if (count < 3) {
        (void)fprintf(stderr, "usage: %s ROWS BYTES [COMMAND]\n", arguments[0]);
        return EXIT_FAILURE;
    }
    board.rows = fopen(arguments[1], "rb");
    board.bytes = fopen(arguments[2], "wb");
    if (board.rows == NULL || board.bytes == NULL) {
        perror(board.rows == NULL ? arguments[1] : arguments[2]);
        return EXIT_FAILURE;
    }
    board_start();
    if (count > 3) {
        receive((uint8_t)arguments[3][0]);
    }
    app_start();
    for (;;) {
        app_step(board_wait());
    }
}
