/* The application that every board runs: sensor to filter to serial line, 100 times a second.
 *
 * Each period: the burst of the sensor, the update of the filter, one frame.  The frame's first byte is
 * handed to the board when the attitude (or its angles, where the frame has those) has been computed, the
 * rest is encoded while that byte is on its way.  A period without a sample has its frame too, with the last attitude and FRAME_SAMPLE_MISSING; the
 * filter is told how many periods passed when samples come again.  A boot frame comes first, and whenever `b`
 * is received.
 *
 * What it does with bad input: no sensor: frames say so, from the first period on (attitude: identity).  No
 * room on the serial line: the frame is dropped, uses its number up, and the next one says FRAME_OVERRUN.  A
 * main loop that was late by whole periods: their numbers are used up too.  An unknown command: ignored.
 */
#ifndef FACTORLAB_APP_H
#define FACTORLAB_APP_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* After `board_start`. */
void app_start(void);

/* To be called with what `board_wait` gives, for ever. */
void app_step(uint8_t events);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_APP_H */
