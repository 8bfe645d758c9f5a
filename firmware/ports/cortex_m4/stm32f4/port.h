/* What the files of this port share. */
#ifndef FACTORLAB_STM32F4_PORT_H
#define FACTORLAB_STM32F4_PORT_H

#include <stdint.h>

#include "../cortex_m4.h"
#include "stm32f4.h"

#define CORE_HZ 84000000UL /* AHB, and the timers of APB1 */
#define APB1_HZ 42000000UL /* USART2, I2C1 */

#define MARK_UPDATE (1UL << 8) /* PA8: high while the filter is updated */
#define MARK_SAMPLE (1UL << 9) /* PA9: high from the end of a transfer to the next byte sent */

/* Core at 84 MHz. */
void clock_start(void);

void serial_start(void);
void serial_release(void); /* what the ring holds may leave */
void serial_hold(void);    /* nothing more begins to leave until then */

void i2c_start(void);

/* From an interrupt: the main loop finds these events. */
void raise_events(uint8_t events);

/* Handlers: vectors.c. */
void systick_handler(void);
void tim2_handler(void);
void usart2_handler(void);
void i2c1_event_handler(void);
void i2c1_error_handler(void);

static inline void mark(uint32_t pin, uint8_t level)
{
    GPIOA->bsrr = level != 0U ? pin : pin << 16;
}

#endif /* FACTORLAB_STM32F4_PORT_H */
