/* A pseudo-terminal in real time: the simulated board's serial line, for programs that expect a board. */
#ifndef FACTORLAB_BRIDGE_H
#define FACTORLAB_BRIDGE_H

#include <stdint.h>

struct bridge {
    int file;             /* of the pseudo-terminal's own end; 0: closed, and every call does nothing */
    uint64_t clock_hz;    /* cycles a second */
    uint64_t start_ns;    /* when cycle 0 was */
    uint64_t looked_at;   /* cycle at which received bytes were last looked for */
};

/* Prints the name of the other end, one line. */
void bridge_open(struct bridge *bridge, uint64_t clock_hz);

void bridge_write(const struct bridge *bridge, uint8_t byte);

/* Waits until `cycle` is now, and hands over what was received. */
void bridge_keep_pace(struct bridge *bridge, uint64_t cycle, void (*receive)(uint8_t byte));

#endif /* FACTORLAB_BRIDGE_H */
