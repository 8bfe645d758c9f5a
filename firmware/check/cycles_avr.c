/* An image that lets the program around the emulator (cycles_avr_simulator.c) feed a filter and count its
 * cycles.
 *
 * Port C asks for a sample, port B is high while the filter works; both are stamped with the cycle outside.
 * The letter box's address stands in GPIOR2:GPIOR1 before the first question.  Nothing here runs on a board.
 *
 * The filter is MODULE (mahony_q unless given), whose constants at 100 Hz are in HEADER.
 */
#ifndef MODULE
#define MODULE mahony_q
#define HEADER "../core/mahony_q_100hz.h"
#endif
#include HEADER

#include <avr/io.h>

#define JOINED(a, b) a##b
#define NAMED(a, b) JOINED(a, b)

struct letter_box {
    uint8_t periods; /* 0: start anew */
    struct imu_q sample;
    struct NAMED(MODULE, _state) state;
};

static struct letter_box box;

int main(void)
{
    GPIOR1 = (uint8_t)((uint16_t)&box & 0xFFU);
    GPIOR2 = (uint8_t)((uint16_t)&box >> 8);
    DDRB = 0xFF;
    DDRC = 0xFF;
    for (;;) {
        PORTC = 1;
        __asm__ volatile("" ::: "memory");
        if (box.periods == 0U) {
            NAMED(MODULE, _start)(&box.state, &NAMED(MODULE, _100hz), &box.sample);
        }
        PORTB = 1;
        NAMED(MODULE, _step)(&box.state, &NAMED(MODULE, _100hz), &box.sample, box.periods);
        PORTB = 0;
        __asm__ volatile("" ::: "memory");
        PORTC = 0;
    }
}
