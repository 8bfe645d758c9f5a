/* Where agree.c prints, and how it ends: standard output, UART 0 of an emulated AVR, or a file through semihosting. */
#ifndef FACTORLAB_AGREE_TARGET_H
#define FACTORLAB_AGREE_TARGET_H

#if defined(__AVR__)

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

static inline void target_start(void)
{
    UCSR0B = (uint8_t)(1U << TXEN0);
}

static inline void target_print(char c)
{
    while ((UCSR0A & (1U << UDRE0)) == 0U) {
    }
    UDR0 = (uint8_t)c;
}

/* Asleep without interrupts: simavr ends. */
static inline void target_stop(void)
{
    cli();
    sleep_enable();
    sleep_cpu();
}

#elif defined(__arm__)

#include "../ports/cortex_m4/qemu/semihosting.h"
#include "../ports/cortex_m4/startup.h"

static int32_t target_file;

static inline void target_start(void)
{
    target_file = semihost_open(1, SEMIHOST_WRITE);
}

static inline void target_print(char c)
{
    semihost_write(target_file, &c, 1);
}

static inline void target_stop(void)
{
    semihost_close(target_file);
    semihost_exit(0);
}

__attribute__((section(".vectors"), used)) static const handler vectors[16] = {
    (handler)stack_top, reset_handler,   default_handler, default_handler, default_handler, default_handler,
    default_handler,    default_handler, default_handler, default_handler, default_handler, default_handler,
    default_handler,    default_handler, default_handler, default_handler,
};

#else

#include <stdio.h>

static inline void target_start(void)
{
}

static inline void target_print(char c)
{
    (void)putchar(c);
}

static inline void target_stop(void)
{
}

#endif

#endif /* FACTORLAB_AGREE_TARGET_H */
