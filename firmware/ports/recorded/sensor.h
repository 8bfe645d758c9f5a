/* An MPU-6050 that answers with recorded counts: what the emulated boards have on their I2C bus.
 *
 * Computes: what the registers that the driver uses would say (reset, sleep, identity, ranges, the burst of
 * 14 bytes), from rows of a recording, one a period, counted from the first burst on: a row that nobody
 * fetched is lost, as on a real sensor.
 * Source: InvenSense RM-MPU-6000A-00 4.2.
 * What it does with bad input: a row may say that the sensor does not answer, holds the bus, or that the bus
 * fails; a write past the registers is not acknowledged; before the first row and asleep it reads zeros.
 */
#ifndef FACTORLAB_RECORDED_SENSOR_H
#define FACTORLAB_RECORDED_SENSOR_H

#include <stddef.h>
#include <stdint.h>

enum recorded_answer { RECORDED_ANSWERS, RECORDED_SILENT, RECORDED_HANGS, RECORDED_FAULT };

struct recorded_row {
    int16_t counts[7]; /* ax ay az temperature gx gy gz, counts */
    uint8_t answer;    /* RECORDED_ANSWERS ... */
    uint8_t command;   /* a byte that the serial line receives in this period, 0: none */
};

/* Gives up to `count` rows, in order; less at the end. */
typedef size_t recorded_reader(struct recorded_row *rows, size_t count);

void recorded_start(recorded_reader *reader);

/* A period begins: 0 when the rows are over. */
int recorded_tick(void);

int32_t recorded_row(void); /* number of the present row, -1 before the first burst */
uint8_t recorded_command(void);

/* How a transfer ends: BOARD_I2C_DONE ... of app/board.h. */
uint8_t recorded_transfer(uint8_t address, const uint8_t *write, uint8_t write_length, uint8_t *read,
                          uint8_t read_length);

#endif /* FACTORLAB_RECORDED_SENSOR_H */
