/* I2C by the TWI unit, 400 kHz: every byte is an interrupt, between them the processor sleeps or computes.
 *
 * Source: Atmel-7810, ATmega328P, 22 (2-wire Serial Interface): states of master transmitter and receiver.
 */
#include <avr/interrupt.h>
#include <util/twi.h>

#include "../../app/board.h"
#include "port.h"

#define TWI_HZ 400000UL
#define TWI_DIVIDER ((F_CPU / TWI_HZ - 16UL) / 2UL)
#define SDA _BV(PORTC4)
#define SCL _BV(PORTC5)
#define RECOVERY_HALF_CLOCKS 18U /* nine clocks, then a stop */

#define GO (_BV(TWINT) | _BV(TWEN) | _BV(TWIE))

static struct {
    const uint8_t *write;   /* next byte to write */
    uint8_t *read;          /* where the next byte read goes */
    uint8_t to_write;       /* bytes */
    uint8_t to_read;        /* bytes */
    uint8_t part;           /* bytes left to read when BOARD_I2C_PART is due; 255: never */
    uint8_t address;        /* 7 bits, shifted; bit 0: reading */
    uint8_t recovering;     /* half clocks since recovery began */
    volatile uint8_t state; /* BOARD_I2C_DONE ... */
} twi;

void twi_start(void)
{
    PORTC |= SDA | SCL; /* weak pull-ups, in case the sensor's board has none */
    TWSR = 0;
    TWBR = TWI_DIVIDER;
    TWCR = _BV(TWEN);
}

void board_i2c_start(uint8_t address, const uint8_t *write, uint8_t write_length, uint8_t *read,
                     uint8_t read_length)
{
    twi.address = (uint8_t)(address << 1);
    twi.write = write;
    twi.to_write = write_length;
    twi.read = read;
    twi.to_read = read_length;
    twi.part = read_length > BOARD_PART ? (uint8_t)(read_length - BOARD_PART) : UINT8_MAX;
    twi.state = BOARD_I2C_BUSY;
    TWCR = GO | _BV(TWSTA);
}

uint8_t board_i2c_state(void)
{
    return twi.state;
}

static inline void end(uint8_t state)
{
    TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
    twi.state = state;
    EVENTS |= BOARD_I2C;
}

/* More bytes to write, or the other direction, or the end. */
static inline void written(void)
{
    if (twi.to_write > 0U) {
        twi.to_write--;
        TWDR = *twi.write++;
        TWCR = GO;
    } else if (twi.to_read > 0U) {
        twi.address |= TW_READ;
        TWCR = GO | _BV(TWSTA);
    } else {
        end(BOARD_I2C_DONE);
    }
}

/* The last byte wanted is not acknowledged: so the device lets go of the bus. */
static inline void want(void)
{
    TWCR = twi.to_read > 1U ? GO | _BV(TWEA) : GO;
}

ISR(TWI_vect)
{
    switch (TW_STATUS) {
    case TW_MR_DATA_ACK:
        *twi.read++ = TWDR;
        twi.to_read--;
        want();
        if (twi.to_read == twi.part) {
            EVENTS |= BOARD_I2C_PART;
        }
        break;
    case TW_MR_DATA_NACK:
        *twi.read = TWDR;
        PORTB |= _BV(MARK_SAMPLE);
        end(BOARD_I2C_DONE);
        break;
    case TW_START:
    case TW_REP_START:
        TWDR = twi.address;
        TWCR = GO;
        break;
    case TW_MT_SLA_ACK:
    case TW_MT_DATA_ACK:
        written();
        break;
    case TW_MR_SLA_ACK:
        want();
        break;
    case TW_MT_SLA_NACK:
    case TW_MT_DATA_NACK:
    case TW_MR_SLA_NACK:
        end(BOARD_I2C_NO_ANSWER);
        break;
    default:
        end(BOARD_I2C_FAULT);
        break;
    }
}

/* Lines are open drain: an output pulls low (its latch is 0), an input lets go. */
static void drive(uint8_t line, uint8_t level)
{
    if (level != 0U) {
        DDRC &= (uint8_t)~line;
        PORTC |= line;
    } else {
        PORTC &= (uint8_t)~line;
        DDRC |= line;
    }
}

uint8_t board_i2c_recover(void)
{
    uint8_t half = twi.recovering++;
    TWCR = 0; /* the pins are ours */
    twi.state = BOARD_I2C_NO_ANSWER;
    if (half < RECOVERY_HALF_CLOCKS) {
        drive(SCL, half & 1U);
        return 0;
    }
    if (half == RECOVERY_HALF_CLOCKS) { /* stop: data rises while the clock is high */
        drive(SCL, 0);
        drive(SDA, 0);
        return 0;
    }
    if (half == RECOVERY_HALF_CLOCKS + 1U) {
        drive(SCL, 1);
        return 0;
    }
    drive(SDA, 1);
    twi.recovering = 0;
    twi_start();
    return 1;
}
