/* The few registers used of the mps2-an386: ARM Cortex-M System Design Kit (DDI 0479), application note 386.
 * The system clock is 25 MHz.
 */
#ifndef FACTORLAB_CMSDK_H
#define FACTORLAB_CMSDK_H

#include <stdint.h>

#define CMSDK_CLOCK_HZ 25000000UL

struct cmsdk_timer {
    volatile uint32_t ctrl;   /* bit 0: count */
    volatile uint32_t value;  /* counts down, one a clock */
    volatile uint32_t reload; /* clocks */
    volatile uint32_t interrupt;
};

struct cmsdk_uart {
    volatile uint32_t data;
    volatile uint32_t state;     /* bit 0: transmit buffer full, bit 1: receive buffer full */
    volatile uint32_t ctrl;      /* bits 0, 1: transmit, receive; bits 2, 3: their interrupts */
    volatile uint32_t interrupt; /* pending, cleared by writing a one: bit 0 transmit, bit 1 receive */
    volatile uint32_t divider;   /* clocks a bit, at least 16 */
};

#define TIMER0 ((struct cmsdk_timer *)0x40000000UL)
#define UART0 ((struct cmsdk_uart *)0x40004000UL)

#define UART_BUFFER_FULL 1U    /* of `state`, transmit */
#define UART_BUFFER_HELD 2U    /* of `state`, receive */
#define UART_INTERRUPT_BOTH 3U /* of `interrupt` */
#define UART_RUN 0xFU          /* of `ctrl`: both ways, both interrupts */

#define UART0_RX_IRQ 0
#define UART0_TX_IRQ 1

#endif /* FACTORLAB_CMSDK_H */
