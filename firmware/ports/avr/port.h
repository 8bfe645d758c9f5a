/* What the files of this port share: ATmega328P at 16 MHz (Arduino Uno, Nano).
 *
 * Events live in a general purpose register: setting a bit there is one instruction, so an interrupt needs
 * neither a lock nor a saved register for it.
 */
#ifndef FACTORLAB_AVR_PORT_H
#define FACTORLAB_AVR_PORT_H

#include <avr/io.h>

#ifndef F_CPU
#error "F_CPU is not defined: compile with -DF_CPU=16000000UL, as the Makefile does"
#endif

#define EVENTS GPIOR0 /* BOARD_TICK ... of board.h */
#define HELD 7        /* bit of EVENTS: the phase of this period is still to come */

#define MARK_SAMPLE PORTB0 /* D8: high from the end of a transfer to the next byte sent */
#define MARK_UPDATE PORTB1 /* D9: high while the filter is updated */

void clock_start(void);
void twi_start(void);
void serial_start(void);

/* What the ring holds may leave. */
void serial_release(void);

#endif /* FACTORLAB_AVR_PORT_H */
