/* Holds the assembler products of fixed_avr.h against the C of fixed_q.h, on the target itself.
 *
 * Prints on UART 0 "products <calls> <differences>": every pair of a list of extremes, then pseudo-random
 * operands. On a machine without assembler both are one function, and the line says so by being the same.
 * Needs core/fixed_q.c.
 */
#include "../core/fixed_q.h"

#ifdef __AVR__
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#endif
#include <stdio.h>

#ifndef PRODUCTS_RANDOM
#define PRODUCTS_RANDOM 20000UL
#endif

static const uint32_t extremes[] = {
    0UL,          1UL,          0xFFUL,       0x100UL,      0x7FFFUL,     0x8000UL,     0x8001UL,
    0xFFFFUL,     0x10000UL,    0x7F7F7F7FUL, 0x80808080UL, 0xFF00FF00UL, 0x00FF00FFUL, 0x7FFFFFFFUL,
    0x80000001UL, 0xFFFFFFFFUL, 0xFFFF8000UL, 0xFFFF7FFFUL, 0x7FFF8000UL, 0x12345678UL, 0x80000000UL,
};

static uint32_t random_bits(void)
{
    static uint32_t x = 2463534242UL;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return x;
}

static uint8_t differences(uint32_t a, uint32_t b)
{
    uint8_t count = 0;
    int16_t a16 = (int16_t)(uint16_t)a;
    int16_t b16 = (int16_t)(uint16_t)b;
    int32_t a32 = (int32_t)a;
    count = (uint8_t)(count + (mul16_q(a16, b16) != mul16_c(a16, b16)));
    count = (uint8_t)(count + (mul16u_q(a16, (uint16_t)b) != mul16u_c(a16, (uint16_t)b)));
    count = (uint8_t)(count + (mulu16_q((uint16_t)a, (uint16_t)b) != mulu16_c((uint16_t)a, (uint16_t)b)));
    count = (uint8_t)(count + (mul32u16_q(a32, (uint16_t)b) != mul32u16_c(a32, (uint16_t)b)));
    if (a != 0x80000000UL) {
        count = (uint8_t)(count + (mul32x16_q(a32, b16) != mul32x16_c(a32, b16)));
        count = (uint8_t)(count + (mul32_q(a32, (int32_t)b) != mul32_c(a32, (int32_t)b)));
    }
    return count;
}

#ifdef __AVR__
static int put(char c, FILE *stream)
{
    (void)stream;
    while ((UCSR0A & (1U << UDRE0)) == 0U) {
    }
    UDR0 = (uint8_t)c;
    return 0;
}

static FILE line = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);
#endif

int main(void)
{
    uint32_t calls = 0;
    uint32_t wrong = 0;
    const uint8_t many = (uint8_t)(sizeof extremes / sizeof extremes[0]);
#ifdef __AVR__
    UCSR0B = (uint8_t)(1U << TXEN0);
    stdout = &line;
#endif
    for (uint8_t i = 0; i < many; i++) {
        for (uint8_t j = 0; j < many; j++) {
            wrong += differences(extremes[i], extremes[j]);
            calls++;
        }
    }
    for (uint32_t n = 0; n < PRODUCTS_RANDOM; n++) {
        uint32_t a = random_bits();
        wrong += differences(a, random_bits());
        calls++;
    }
    printf("products %lu %lu\n", (unsigned long)calls, (unsigned long)wrong);
#ifdef __AVR__
    cli();
    sleep_enable();
    sleep_cpu();
#endif
    return wrong != 0U;
}
