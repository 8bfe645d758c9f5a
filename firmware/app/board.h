/* What the application asks of a board: a clock, an I2C bus, a serial line, sleep.
 *
 * A port implements these functions; app.c and mpu6050.c are the same on every board.  Nothing here waits but
 * `board_wait`, which sleeps: an interrupt leaves an event, the main loop takes it.
 *
 * Phase.  A period begins with BOARD_TICK.  What is written to the serial line between a tick and the phase
 * of that period leaves at the phase, by a compare interrupt of the timer that ticks, so that the period of
 * the frames does not jitter with the arithmetic before them; what is written later leaves at once.  Bytes
 * that were on their way before the tick go on.  A board without such a timer sends at once.
 *
 * What it does with bad input: a transfer that nobody acknowledges ends with BOARD_I2C_NO_ANSWER; one that
 * never ends stays BOARD_I2C_BUSY, and the driver frees the bus with `board_i2c_recover`; bytes that find no
 * room in the ring are refused as a whole; commands that nobody fetched in time are lost.
 */
#ifndef FACTORLAB_BOARD_H
#define FACTORLAB_BOARD_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BOARD_RATE_HZ 100U      /* ticks a second */
#define BOARD_PERIOD_US 10000UL /* us from tick to tick */

/* Events, as bits. */
#define BOARD_TICK 0x01U     /* a period has begun */
#define BOARD_I2C 0x02U      /* the transfer has ended */
#define BOARD_RECEIVED 0x04U /* bytes have come on the serial line */
#define BOARD_I2C_PART 0x08U /* BOARD_PART bytes of the transfer have been read; a board may never say so */

#define BOARD_PART 6U /* bytes: of a sample, the accelerometer, which need not wait for the rest */

/* How a transfer stands. */
#define BOARD_I2C_DONE 0U
#define BOARD_I2C_BUSY 1U
#define BOARD_I2C_NO_ANSWER 2U /* address or byte not acknowledged */
#define BOARD_I2C_FAULT 3U     /* bus error or arbitration lost */

/* What a phase is chosen for: each needs another time for its arithmetic. */
#define BOARD_AFTER_UPDATE 0U /* filter alone: quaternion and raw frames */
#define BOARD_AFTER_ANGLES 1U /* filter and angles: angle frames and text */

extern const uint8_t board_target; /* BOOT_ATMEGA328P ... of core/frame.h */

/* Clocks, pins, timer, I2C and serial line; interrupts are on when it returns. */
void board_start(void);

/* Sleeps until there is an event; gives all events since the last call and forgets them. */
uint8_t board_wait(void);

/* Periods that began since the last call: 1 when the main loop keeps up. */
uint8_t board_periods(void);

/* Time at which the present period began, us since start, modulo 2^32. */
uint32_t board_time_us(void);

void board_phase(uint8_t after /* BOARD_AFTER_... */);

/* Writes `write_length` (>= 1) bytes to a device, then, unless `read_length` is 0, reads after a repeated
 * start.  Returns at once; BOARD_I2C follows.  Both arrays stay in use until then. */
void board_i2c_start(uint8_t address /* 7 bits */, const uint8_t *write, uint8_t write_length, uint8_t *read,
                     uint8_t read_length);
uint8_t board_i2c_state(void); /* BOARD_I2C_DONE ... */

/* Half a clock of the nine and the stop that free a bus whose data line a device holds low: call it once a
 * period until it returns 1.  (Philips UM10204, 3.1.16.) */
uint8_t board_i2c_recover(void);

/* Puts all bytes into the ring of the serial line, or none: 0 if there is no room. */
uint8_t board_write(const uint8_t *bytes, uint8_t length);
uint8_t board_room(void); /* bytes */

/* The oldest byte received that was not fetched yet, -1: none. */
int16_t board_received(void);

/* A pin that is high while the filter is updated; another, not ours, rises when a transfer has ended and
 * falls with the first byte of a frame: an oscilloscope shows cycles and latency. */
void board_mark_update(uint8_t level);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_BOARD_H */
