/* The serial line: 8 data bits, no parity, one stop bit; rings and interrupts both ways.
 *
 * Baud: 250 000, 500 000 and 1 000 000 divide 16 MHz exactly; 115 200 becomes 117 647, +2.1 %, which most
 * receivers still take.
 */
#include <avr/interrupt.h>

#include "../../app/board.h"
#include "port.h"

#ifndef BAUD
#define BAUD 500000UL
#endif
#define DIVIDER ((F_CPU + 4UL * BAUD) / (8UL * BAUD)) /* with U2X, rounded */
#define REAL_BAUD (F_CPU / (8UL * DIVIDER))

#if REAL_BAUD * 40UL > BAUD * 41UL || REAL_BAUD * 40UL < BAUD * 39UL
#error "this BAUD cannot be had from F_CPU within 2.5 %; 250000, 500000 and 1000000 are exact at 16 MHz"
#endif

#define RING 128U /* bytes, a power of two: a frame or a line, and what is still on its way */
#define RECEIVED 8U

static struct {
    uint8_t bytes[RING];
    volatile uint8_t head; /* where the next byte is put */
    volatile uint8_t tail; /* the next byte to leave */
} ring;

static struct {
    uint8_t bytes[RECEIVED];
    volatile uint8_t head, tail;
} received;

ISR(USART_UDRE_vect)
{
    uint8_t tail = ring.tail;
    if (tail != ring.head) {
        UDR0 = ring.bytes[tail];
        PORTB &= (uint8_t)~_BV(MARK_SAMPLE);
        tail = (tail + 1U) & (RING - 1U);
        ring.tail = tail;
    }
    if (tail == ring.head) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
    }
}

ISR(USART_RX_vect)
{
    uint8_t broken = UCSR0A & _BV(FE0); /* no stop bit: another baud, or a line that floats */
    uint8_t byte = UDR0;
    uint8_t next = (received.head + 1U) & (RECEIVED - 1U);
    if (broken == 0U && next != received.tail) {
        received.bytes[received.head] = byte;
        received.head = next;
        EVENTS |= BOARD_RECEIVED;
    }
}

void serial_start(void)
{
    UCSR0A = _BV(U2X0);
    UBRR0 = DIVIDER - 1U;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

void serial_release(void)
{
    if (ring.tail != ring.head) {
        UCSR0B |= _BV(UDRIE0);
    }
}

uint8_t board_room(void)
{
    return (uint8_t)((uint8_t)(ring.tail - ring.head - 1) & (RING - 1U));
}

uint8_t board_write(const uint8_t *bytes, uint8_t length)
{
    uint8_t head = ring.head;
    if (length > board_room()) {
        return 0;
    }
    for (; length > 0U; length--) {
        ring.bytes[head] = *bytes++;
        head = (head + 1U) & (RING - 1U);
    }
    ring.head = head;
    /* The phase may pass between these two lines: then both enable the interrupt, which is no harm. */
    if ((EVENTS & _BV(HELD)) == 0U) {
        serial_release();
    }
    return 1;
}

int16_t board_received(void)
{
    uint8_t tail = received.tail;
    int16_t byte;
    if (tail == received.head) {
        return -1;
    }
    byte = received.bytes[tail];
    received.tail = (tail + 1U) & (RECEIVED - 1U);
    return byte;
}
