/* A ring of bytes between the main loop and one interrupt: one side puts, the other takes, neither waits.
 *
 * Head and tail are single bytes, each written by one side only, so that no side needs to stop the other.
 * What it does with bad input: bytes that find no room are refused as a whole.
 */
#ifndef FACTORLAB_RING_H
#define FACTORLAB_RING_H

#include <stdint.h>

struct ring {
    volatile uint8_t bytes[256];
    volatile uint8_t head; /* where the next byte goes: the putting side's */
    volatile uint8_t tail; /* where the oldest lies: the taking side's */
};

static inline uint8_t ring_room(const struct ring *ring)
{
    return (uint8_t)(ring->tail - ring->head - 1U);
}

static inline uint8_t ring_put(struct ring *ring, const uint8_t *bytes, uint8_t length)
{
    uint8_t head = ring->head;
    if (ring_room(ring) < length) {
        return 0;
    }
    for (uint8_t k = 0; k < length; k++) {
        ring->bytes[head++] = bytes[k];
    }
    ring->head = head;
    return 1;
}

/* The oldest byte; -1 where the ring is empty. */
static inline int16_t ring_take(struct ring *ring)
{
    const uint8_t tail = ring->tail;
    if (tail == ring->head) {
        return -1;
    }
    const uint8_t byte = ring->bytes[tail];
    ring->tail = (uint8_t)(tail + 1U);
    return (int16_t)byte;
}

static inline uint8_t ring_is_empty(const struct ring *ring)
{
    return ring->head == ring->tail;
}

#endif /* FACTORLAB_RING_H */
