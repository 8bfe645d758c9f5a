/* Registers and instructions of the core itself: ARMv7-M Architecture Reference Manual (DDI 0403), B3. */
#ifndef FACTORLAB_CORTEX_M4_H
#define FACTORLAB_CORTEX_M4_H

#include <stdint.h>

struct systick {
    volatile uint32_t ctrl;  /* bit 0: count, 1: interrupt, 2: processor clock, 16: reached zero */
    volatile uint32_t load;  /* clocks a period, less one */
    volatile uint32_t value; /* counts down; any write clears it */
};

#define SYSTICK ((struct systick *)0xE000E010UL)
#define SYSTICK_RUN 7U /* count, interrupt, processor clock */

#define NVIC_ENABLE ((volatile uint32_t *)0xE000E100UL) /* a bit an interrupt */
#define NVIC_PEND ((volatile uint32_t *)0xE000E200UL)

static inline void interrupt_enable(uint32_t number)
{
    NVIC_ENABLE[number / 32U] = 1UL << (number % 32U);
}

/* As if the peripheral had asked: its handler runs as soon as it may. */
static inline void interrupt_pend(uint32_t number)
{
    NVIC_PEND[number / 32U] = 1UL << (number % 32U);
}

static inline void interrupts_off(void)
{
    __asm volatile("cpsid i" ::: "memory");
}

static inline void interrupts_on(void)
{
    __asm volatile("cpsie i" ::: "memory");
}

/* Sleeps until an interrupt is pending, masked or not. */
static inline void wait_for_interrupt(void)
{
    __asm volatile("dsb\n\twfi" ::: "memory");
}

#endif /* FACTORLAB_CORTEX_M4_H */
