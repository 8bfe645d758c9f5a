/* An MPU-6050 on simulated I2C that gives recorded samples when the real one would have had them.
 *
 * The first burst from 0x3B is answered with row 0; from then on a burst is answered with the row of its
 * time, 100 a second, so rows that nobody fetched are lost, as on a board.  Registers that were written read
 * back.
 * Bytes take the time that the bit rate asks for (simavr's own I2C takes 9 us for each, whatever it says).
 *
 * Faults, one byte a row: SLAVE_ABSENT does not acknowledge its address, SLAVE_HUNG acknowledges and then
 * holds the clock low for ever (until the master gives the bus up).
 */
#ifndef FACTORLAB_SLAVE_H
#define FACTORLAB_SLAVE_H

#include <stddef.h>
#include <stdint.h>

#include <simavr/avr_twi.h>
#include <simavr/sim_avr.h>

enum slave_fault { SLAVE_GOOD = 0, SLAVE_ABSENT = 1, SLAVE_HUNG = 2 };

struct slave {
    avr_t *avr;
    avr_irq_t *bus;              /* of the TWI unit */
    avr_twi_t *unit;             /* the TWI unit itself */
    const int16_t (*counts)[7];  /* rows ax ay az temperature gx gy gz */
    const uint8_t *faults;       /* one a row, or NULL */
    size_t rows;                 /* of counts */
    uint64_t period;             /* cycles from row to row */
    uint64_t first;              /* cycle of the first burst, 0: none yet */
    void (*served)(uint32_t row); /* called when a burst begins */
    uint8_t registers[128];
    uint8_t pointer;             /* register to be read or written next */
    uint8_t named;               /* the pointer was written in this transfer */
    uint8_t chosen;              /* our address was called */
    uint8_t hangs;               /* the clock is held from now on */
};

void slave_attach(struct slave *slave, avr_t *avr, uint8_t who_am_i);

#endif /* FACTORLAB_SLAVE_H */
