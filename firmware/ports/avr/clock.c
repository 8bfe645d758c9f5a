/* Ticks, phase and sleep: TIMER1 counts half microseconds from 0 to 19 999.
 *
 * Compare A ends the period; compare B is the phase at which a frame may begin to leave.  The timer needs
 * nobody: its period is 160 000 cycles whatever the program does.
 */
#include <avr/interrupt.h>
#include <avr/power.h>
#include <avr/sleep.h>

#include "../../app/board.h"
#include "../../core/frame.h"
#include "port.h"

#define COUNTS_PER_US (F_CPU / 8000000UL)
#define PERIOD_COUNTS (BOARD_PERIOD_US * COUNTS_PER_US)

#if F_CPU % 8000000UL != 0 || PERIOD_COUNTS > 65536UL
#error "TIMER1 counts F_CPU / 8: F_CPU must be 8 or 16 MHz, or choose another divider here"
#endif
#if !defined(PHASE_UPDATE_US) || !defined(PHASE_ANGLES_US)
#error "PHASE_UPDATE_US and PHASE_ANGLES_US say when frames leave, us after the tick: see the Makefile"
#endif

const uint8_t board_target = BOOT_ATMEGA328P;

static volatile uint8_t begun; /* periods that began since board_periods */
static uint32_t time_us;       /* us, start of the present period */

ISR(TIMER1_COMPA_vect)
{
    begun++;
    EVENTS |= _BV(HELD) | BOARD_TICK;
}

ISR(TIMER1_COMPB_vect)
{
    EVENTS &= (uint8_t)~_BV(HELD);
    serial_release();
}

void clock_start(void)
{
    TCCR1A = 0;
    TCCR1B = _BV(WGM12) | _BV(CS11); /* clear at compare A; F_CPU / 8 */
    OCR1A = PERIOD_COUNTS - 1U;
    OCR1B = PHASE_UPDATE_US * COUNTS_PER_US;
    TIMSK1 = _BV(OCIE1A) | _BV(OCIE1B);
}

void board_start(void)
{
    power_adc_disable();
    power_spi_disable();
    power_timer0_disable();
    power_timer2_disable();
    DDRB = _BV(MARK_SAMPLE) | _BV(MARK_UPDATE);
    SMCR = 0; /* sleep is idle mode: timer, TWI and serial line go on */
    serial_start();
    twi_start();
    clock_start();
    sei();
}

uint8_t board_wait(void)
{
    uint8_t taken;
    cli();
    while ((taken = EVENTS & (uint8_t)~_BV(HELD)) == 0U) {
        sleep_enable();
        sei(); /* no interrupt comes before the instruction after it, which is sleep */
        sleep_cpu();
        sleep_disable();
        cli();
    }
    EVENTS &= _BV(HELD);
    sei();
    return taken;
}

uint8_t board_periods(void)
{
    uint8_t periods;
    cli();
    periods = begun;
    begun = 0;
    sei();
    for (uint8_t k = 0; k < periods; k++) {
        time_us += BOARD_PERIOD_US;
    }
    return periods;
}

uint32_t board_time_us(void)
{
    return time_us;
}

void board_phase(uint8_t after)
{
    uint16_t counts =
        (after == BOARD_AFTER_ANGLES ? PHASE_ANGLES_US : PHASE_UPDATE_US) * COUNTS_PER_US;
    cli(); /* a 16-bit register is written in two halves */
    OCR1B = counts;
    sei();
}

void board_mark_update(uint8_t level)
{
    if (level != 0U) {
        PORTB |= _BV(MARK_UPDATE);
    } else {
        PORTB &= (uint8_t)~_BV(MARK_UPDATE);
    }
}
