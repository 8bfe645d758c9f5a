/* mahony_q_step, mahony_q_update and mahony_q_start in assembler for an AVR, bit for bit the C of mahony_q_update.c,
 * turning_q.c and mahony_q_start.c: the tests hold them against each other in the emulator, sample by sample.
 *
 * gcc makes 10 000 cycles an update of that C: numbers of 32 bits do not fit its choice of registers.  Here the longest
 * update takes less than half of that; what the calls of `pieces` cost (7 cycles each) is bought with flash.
 *
 * Offsets of the structs are those of mahony_q.h; the declarations below do not compile when they change.
 */
#include "mahony_q_parts.h"

#ifdef __AVR__

#include <stddef.h>

#define PLACED(type, field, at) typedef char placed_##field[offsetof(struct type, field) == (at) ? 1 : -1]
PLACED(mahony_q_state, bias, 16);
PLACED(mahony_q_state, gyro_low, 28);
PLACED(mahony_q_state, accel_low, 40);
PLACED(mahony_q_state, lasting, 49);
PLACED(mahony_q_state, turn_left, 55);
PLACED(mahony_q_state, status, 58);
PLACED(mahony_q_state, start_left, 59);
PLACED(mahony_q_state, still, 61);
PLACED(mahony_q_derived, bias_limit, 4);
PLACED(mahony_q_derived, rest_gyro, 8);
PLACED(mahony_q_derived, rest_accel, 12);
PLACED(mahony_q_derived, weights, 16);
PLACED(mahony_q_derived, gain, 25);
PLACED(mahony_q_derived, boost, 27);
PLACED(mahony_q_derived, error_limit, 29);
PLACED(mahony_q_derived, start_periods, 35);
PLACED(mahony_q_derived, rest_periods, 37);
PLACED(mahony_q_derived, gyro_limit, 41);

/* one statement, so that nothing comes between its lines */
__asm__(
#include "mahony_q_avr_words.inc"
#include "mahony_q_avr_update.inc"
#include "mahony_q_avr_pieces.inc"
#include "mahony_q_avr_start.inc"
    ".text\n");

#endif
