/* When things happened in each period, for the computer that emulates us.
 *
 * Times are counts of CMSDK timer 0 (25 MHz), so that one instruction is 2^shift / 40 counts at QEMU's
 * `-icount shift=...`; 0 says that it did not happen.  The first record is not of a period: its row is
 * LOG_EMPTY, and its update one without a filter, to be taken off the others.  Nor is the last, LOG_STACK.
 */
#ifndef FACTORLAB_LOG_H
#define FACTORLAB_LOG_H

#include <stdint.h>

#define LOG_EMPTY (-2)
#define LOG_STACK (-3) /* its `tick` is the most stack that was used, bytes */

struct log_period {
    int32_t row;           /* of the recording, -1 before the sensor gave one */
    uint32_t tick;         /* counts */
    uint32_t sample;       /* counts: the samples are in memory */
    uint32_t update_start; /* counts */
    uint32_t update_end;   /* counts */
    uint32_t first_byte;   /* counts: handed to the UART */
    uint32_t sent;         /* bytes handed to the UART before this period */
};

/* The semihosting argument that names the file of the log. */
void log_start(unsigned argument);

/* Ends the present record and begins one. */
struct log_period *log_next(void);

void log_flush(void);

#endif /* FACTORLAB_LOG_H */
