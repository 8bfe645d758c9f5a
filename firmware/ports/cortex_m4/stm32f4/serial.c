/* USART2 on PA2 (transmit) and PA3 (receive), which is the USB serial line of a Nucleo-64: 8N1, rings and
 * interrupts. */
#include "../../../app/board.h"
#include "../ring.h"
#include "port.h"

#ifndef BAUD
#define BAUD 500000UL
#endif
#define DIVIDER ((APB1_HZ + BAUD / 2UL) / BAUD)
#if DIVIDER < 16
#error "BAUD is at most APB1_HZ / 16"
#endif

static struct ring out, in;
static volatile uint8_t held; /* 1: what is put waits for the phase */

/* The handler changes this register as well.  QEMU's STM32F405 never asks for a byte by itself, hence the
 * second line; a real one does so at once. */
static void ask_for_bytes(void)
{
    interrupts_off();
    USART2->cr1 |= USART_CR1_TXEIE;
    interrupts_on();
    interrupt_pend(USART2_IRQ);
}

static void receive(uint32_t state)
{
    const uint8_t byte = (uint8_t)USART2->dr; /* after the state, reading this clears it */
    if ((state & USART_SR_RXNE) != 0U && ring_put(&in, &byte, 1) != 0U) {
        raise_events(BOARD_RECEIVED);
    }
}

void usart2_handler(void)
{
    uint32_t state = USART2->sr;
    if ((state & (USART_SR_RXNE | USART_SR_ORE)) != 0U) {
        receive(state);
    }
    for (; (state & USART2->cr1 & USART_SR_TXE) != 0U; state = USART2->sr) { /* TXEIE is the same bit */
        const int16_t byte = ring_take(&out);
        if (byte < 0) {
            USART2->cr1 &= ~USART_CR1_TXEIE;
            return;
        }
        USART2->dr = (uint32_t)byte;
        mark(MARK_SAMPLE, 0);
    }
}

void serial_start(void)
{
    RCC->apb1enr |= RCC_APB1_USART2;
    GPIOA->moder |= (GPIO_ALTERNATE << 4) | (GPIO_ALTERNATE << 6);
    GPIOA->pupdr |= GPIO_UP << 6; /* an open line is not noise */
    GPIOA->afr[0] |= (7UL << 8) | (7UL << 12);
    USART2->brr = DIVIDER;
    USART2->cr1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
    interrupt_enable(USART2_IRQ);
}

void serial_hold(void)
{
    held = 1;
}

void serial_release(void)
{
    held = 0;
    if (ring_is_empty(&out) == 0U) {
        ask_for_bytes();
    }
}

uint8_t board_write(const uint8_t *bytes, uint8_t length)
{
    const uint8_t written = ring_put(&out, bytes, length);
    if (held == 0U) { /* the phase may pass just now: then both enable the interrupt, which is no harm */
        ask_for_bytes();
    }
    return written;
}

uint8_t board_room(void)
{
    return ring_room(&out);
}

int16_t board_received(void)
{
    return ring_take(&in);
}
