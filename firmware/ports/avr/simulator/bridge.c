#define _XOPEN_SOURCE 700
#include "bridge.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define LOOK_EVERY 16000U /* cycles: 1 ms */

static uint64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000U + (uint64_t)now.tv_nsec;
}

void bridge_open(struct bridge *bridge, uint64_t clock_hz)
{
    struct termios raw;
    int other;
    bridge->file = posix_openpt(O_RDWR | O_NOCTTY);
    if (bridge->file < 0 || grantpt(bridge->file) != 0 || unlockpt(bridge->file) != 0) {
        fprintf(stderr, "simulate: no pseudo-terminal to be had\n");
        exit(1);
    }
    other = open(ptsname(bridge->file), O_RDWR | O_NOCTTY); /* kept open: readers may come and go */
    if (other < 0 || tcgetattr(other, &raw) != 0) {
        fprintf(stderr, "simulate: cannot open %s\n", ptsname(bridge->file));
        exit(1);
    }
    raw.c_iflag = 0;
    raw.c_oflag = 0;
    raw.c_lflag = 0;
    tcsetattr(other, TCSANOW, &raw);
    fcntl(bridge->file, F_SETFL, O_NONBLOCK);
    printf("%s\n", ptsname(bridge->file));
    fflush(stdout);
    bridge->clock_hz = clock_hz;
    bridge->start_ns = now_ns();
}

void bridge_write(const struct bridge *bridge, uint8_t byte)
{
    if (bridge->file > 0 && write(bridge->file, &byte, 1) < 0) {
        return; /* nobody reads and the terminal is full: lost, as on a wire */
    }
}

void bridge_keep_pace(struct bridge *bridge, uint64_t cycle, void (*receive)(uint8_t byte))
{
    uint8_t byte;
    uint64_t due, now;
    if (bridge->file <= 0 || cycle - bridge->looked_at < LOOK_EVERY) {
        return;
    }
    bridge->looked_at = cycle;
    due = bridge->start_ns + cycle * 1000U / (bridge->clock_hz / 1000000U);
    now = now_ns();
    if (due > now) {
        struct timespec rest = {(time_t)((due - now) / 1000000000U), (long)((due - now) % 1000000000U)};
        nanosleep(&rest, NULL);
    }
    while (read(bridge->file, &byte, 1) == 1) {
        receive(byte);
    }
}
