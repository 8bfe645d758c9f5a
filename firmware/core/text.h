/* Attitude as a line that a person reads in a terminal.
 *
 * Computes: $ATT,sequence,t_ms,roll,pitch,yaw*hh and carriage return, line feed; t_ms is the board's clock in
 * whole milliseconds, angles are in degrees with two decimals, hh is the exclusive or of the characters
 * between $ and * in two hexadecimal digits (as in NMEA 0183).
 *     $ATT,41,410,-0.35,12.07,179.99*53
 * Cost: AVR -O2, 3 985 cycles at worst (long numbers), 0.9 kB of flash.
 * Source: own. Degrees are the angle times 36000 / 65536 = 1125 / 2048, rounded to nearest, halves away from
 * zero; decimal digits come from counting down powers of ten: an AVR has no divider.
 *
 * What it does with bad input: any values give a line of at most TEXT_LARGEST characters. -180 deg is
 * written -180.00; what rounds to zero has no sign. */
#ifndef FACTORLAB_TEXT_H
#define FACTORLAB_TEXT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TEXT_LARGEST 48U /* characters: no line is longer */

/* Writes one line to `out` (TEXT_LARGEST bytes are enough; no zero at the end) and returns its length. */
uint8_t text_attitude(uint8_t *out, uint16_t sequence, uint32_t t_us,
                      const int16_t roll_pitch_yaw[3] /* 65536 = 360 deg */);

#ifdef __cplusplus
}
#endif
#endif
