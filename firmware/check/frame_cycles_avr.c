/* Cycles of the encoders on an ATmega328P: worst and mean over samples that are made here.
 *
 *     avr-gcc -mmcu=atmega328p -std=c99 -O2 -DF_CPU=16000000UL -I../core frame_cycles_avr.c \
 *         ../core/frame.c ../core/text.c ../core/crc16.c
 *     simavr -m atmega328p -f 16000000 a.out
 *
 * TIMER1 counts cycles; the cost of an empty measurement is taken off.  A line each: name, worst, mean.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdio.h>

#include "frame.h"
#include "text.h"

#define SAMPLES 200U

static uint8_t out[TEXT_LARGEST];
static uint32_t seed = 1;
static int32_t world_q_body[4], bias[3];
static int16_t angles[3], counts[7];
static uint16_t sequence;
static uint32_t t_us;

static uint32_t any(void)
{
    seed = seed * 1664525UL + 1013904223UL;
    return seed;
}

/* The first sample has the longest digits of all; the others are whatever comes. */
static void invent(uint16_t sample)
{
    for (uint8_t k = 0; k < 4; k++) {
        world_q_body[k] = (int32_t)any();
    }
    for (uint8_t k = 0; k < 3; k++) {
        bias[k] = (int32_t)any();
        angles[k] = sample == 0U ? -32750 : (int16_t)(any() >> 16);
    }
    for (uint8_t k = 0; k < 7; k++) {
        counts[k] = (int16_t)(any() >> 16);
    }
    sequence = sample == 0U ? 59999U : (uint16_t)(any() >> 16);
    t_us = sample == 0U ? 3999999999UL : any();
}

static void nothing(void)
{
    __asm__ volatile("" ::: "memory");
}

static void quaternion(void)
{
    (void)frame_quaternion(out, sequence, t_us, world_q_body, bias, 1);
}

static void angle(void)
{
    (void)frame_angles(out, sequence, t_us, angles, bias, 1);
}

static void raw(void)
{
    (void)frame_raw(out, sequence, t_us, counts, 1);
}

static void line(void)
{
    (void)text_attitude(out, sequence, t_us, angles);
}

static uint16_t cycles(void (*encoder)(void))
{
    TCNT1 = 0;
    encoder();
    return TCNT1;
}

static int put(char character, FILE *file)
{
    (void)file;
    loop_until_bit_is_set(UCSR0A, UDRE0);
    UDR0 = (uint8_t)character;
    return 0;
}

static void measure(const char *name, void (*encoder)(void))
{
    uint16_t worst = 0;
    uint32_t sum = 0;
    for (uint16_t sample = 0; sample < SAMPLES; sample++) {
        invent(sample);
        uint16_t empty = cycles(nothing);
        uint16_t taken = (uint16_t)(cycles(encoder) - empty);
        worst = taken > worst ? taken : worst;
        sum += taken;
    }
    printf("%s %u %lu\n", name, worst, (unsigned long)(sum / SAMPLES));
}

int main(void)
{
    static FILE console = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);
    stdout = &console;
    UCSR0B = 1 << TXEN0;
    TCCR1B = 1 << CS10;
    measure("quaternion", quaternion);
    measure("angles", angle);
    measure("raw", raw);
    measure("text", line);
    cli();
    sleep_enable();
    sleep_cpu();
    return 0;
}
