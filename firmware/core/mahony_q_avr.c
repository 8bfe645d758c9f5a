/* mahony_q_step, mahony_q_update and mahony_q_start in assembler for an AVR, bit for bit the C of
 * mahony_q_update.c, turning_q.c and mahony_q_start.c: the tests hold them against each other in the
 * emulator, sample by sample.
 *
 * gcc makes 10 000 cycles an update of that C: numbers of 32 bits do not fit its choice of registers.  Here
 * the longest update takes less than half of that; what the calls of `pieces` cost (7 cycles each) is bought
 * with flash.
 *
 * Offsets of the structs are those of mahony_q.h; the declarations below do not compile when they change.
 */
#include "mahony_q_parts.h"

#ifdef __AVR__

#include <stddef.h>

typedef char state_is_laid_out[
    offsetof(struct mahony_q_state, bias) == 16 &&
    offsetof(struct mahony_q_state, gyro_low) == 28 &&
    offsetof(struct mahony_q_state, accel_low) == 40 &&
    offsetof(struct mahony_q_state, lasting) == 49 &&
    offsetof(struct mahony_q_state, turn_left) == 55 &&
    offsetof(struct mahony_q_state, status) == 58 &&
    offsetof(struct mahony_q_state, start_left) == 59 &&
    offsetof(struct mahony_q_state, still) == 61 ? 1 : -1];
typedef char derived_is_laid_out[
    offsetof(struct mahony_q_derived, bias_limit) == 4 &&
    offsetof(struct mahony_q_derived, rest_gyro) == 8 &&
    offsetof(struct mahony_q_derived, rest_accel) == 12 &&
    offsetof(struct mahony_q_derived, weights) == 16 &&
    offsetof(struct mahony_q_derived, gain) == 25 &&
    offsetof(struct mahony_q_derived, boost) == 27 &&
    offsetof(struct mahony_q_derived, error_limit) == 29 &&
    offsetof(struct mahony_q_derived, start_periods) == 35 &&
    offsetof(struct mahony_q_derived, rest_periods) == 37 &&
    offsetof(struct mahony_q_derived, gyro_limit) == 41 ? 1 : -1];

/* one statement, so that nothing comes between its lines */
__asm__(
#include "mahony_q_avr_words.inc"
#include "mahony_q_avr_update.inc"
#include "mahony_q_avr_pieces.inc"
#include "mahony_q_avr_start.inc"
    ".text\n");

#endif
