/* I2C1 at 400 kHz on PB8 (clock) and PB9 (data): bytes by interrupts, the main loop sleeps or computes.
 *
 * Source: RM0368 18.3.3, master transmitter and receiver.  The last bytes of a read are taken by BTF, when
 * two lie in the data and the shift register and the clock is held: so no deadline hangs on the
 * acknowledgement being taken back in time (a single byte: acknowledgement off before the address is
 * cleared; two: POS).
 * tests/firmware/stm32/ runs this file against a model of the peripheral made after the same pages.
 */
#include "../../../app/board.h"
#include "port.h"

#define BUS_HZ 400000UL
#define CLOCKS (APB1_HZ / (3UL * BUS_HZ))             /* fast mode, low twice as long as high */
#define RISE (APB1_HZ / 1000000UL * 3UL / 10UL + 1UL) /* 300 ns */
#define SCL (1UL << 8)
#define SDA (1UL << 9)
#define MODE_MASK ((3UL << 16) | (3UL << 18))
#define MODE_I2C ((GPIO_ALTERNATE << 16) | (GPIO_ALTERNATE << 18))
#define MODE_OUTPUT ((GPIO_OUTPUT << 16) | (GPIO_OUTPUT << 18))
#define RECOVERY_HALF_CLOCKS 18U /* nine clocks, then a stop */
#define ERRORS (I2C_SR1_BERR | I2C_SR1_ARLO | I2C_SR1_AF | I2C_SR1_OVR)
#define EVENTS_AND_ERRORS (I2C_CR2_ITEVTEN | I2C_CR2_ITERREN)

static struct {
    const uint8_t *write;   /* next byte to write */
    uint8_t *read;          /* where the next byte read goes */
    uint8_t to_write;       /* bytes */
    uint8_t to_read;        /* bytes */
    uint8_t address;        /* 7 bits, shifted; bit 0: reading */
    uint8_t recovering;     /* half clocks since recovery began */
    volatile uint8_t state; /* BOARD_I2C_DONE ... */
} bus;

static void set_up(void)
{
    I2C1->cr1 = I2C_CR1_SWRST; /* lets go of a bus that it takes for busy */
    I2C1->cr1 = 0;
    I2C1->cr2 = APB1_HZ / 1000000UL;
    I2C1->ccr = I2C_CCR_FAST | CLOCKS;
    I2C1->trise = RISE;
    I2C1->cr1 = I2C_CR1_PE;
}

void i2c_start(void)
{
    RCC->apb1enr |= RCC_APB1_I2C1;
    GPIOB->otyper |= SCL | SDA;
    GPIOB->pupdr |= (GPIO_UP << 16) | (GPIO_UP << 18); /* weak: the sensor's board has its own */
    GPIOB->afr[1] |= (4UL << 0) | (4UL << 4);
    GPIOB->moder = (GPIOB->moder & ~MODE_MASK) | MODE_I2C;
    set_up();
    interrupt_enable(I2C1_EV_IRQ);
    interrupt_enable(I2C1_ER_IRQ);
}

void board_i2c_start(uint8_t address, const uint8_t *write, uint8_t write_length, uint8_t *read,
                     uint8_t read_length)
{
    bus.address = (uint8_t)(address << 1);
    bus.write = write;
    bus.to_write = write_length;
    bus.read = read;
    bus.to_read = read_length;
    bus.state = BOARD_I2C_BUSY;
    I2C1->cr2 |= EVENTS_AND_ERRORS | I2C_CR2_ITBUFEN;
    I2C1->cr1 |= I2C_CR1_START;
}

uint8_t board_i2c_state(void)
{
    return bus.state;
}

static void end(uint8_t state)
{
    I2C1->cr2 &= ~(EVENTS_AND_ERRORS | I2C_CR2_ITBUFEN);
    bus.state = state;
    if (state == BOARD_I2C_DONE && bus.address % 2U == 1U) {
        mark(MARK_SAMPLE, 1);
    }
    raise_events(BOARD_I2C);
}

static void stop(uint8_t state)
{
    I2C1->cr1 |= I2C_CR1_STOP;
    end(state);
}

static void take(void)
{
    *bus.read++ = (uint8_t)I2C1->dr;
    bus.to_read--;
}

/* Reading both status registers clears the address, and the first byte comes in. */
static void clear_address(void)
{
    const uint32_t first = I2C1->sr1;
    const uint32_t second = I2C1->sr2;
    (void)first;
    (void)second;
}

static void addressed_to_read(void)
{
    const uint32_t kept = I2C1->cr1 & ~(I2C_CR1_ACK | I2C_CR1_POS);
    if (bus.to_read <= 3U && bus.to_read > 1U) {
        I2C1->cr2 &= ~I2C_CR2_ITBUFEN; /* by BTF from the start */
    }
    switch (bus.to_read) {
    case 1:
        I2C1->cr1 = kept;
        clear_address();
        I2C1->cr1 |= I2C_CR1_STOP;
        break;
    case 2:
        I2C1->cr1 = kept | I2C_CR1_ACK | I2C_CR1_POS;
        clear_address();
        I2C1->cr1 &= ~I2C_CR1_ACK;
        break;
    default:
        I2C1->cr1 = kept | I2C_CR1_ACK;
        clear_address();
        break;
    }
}

/* A byte left, or room for one is there. */
static void transmit(uint32_t state)
{
    if (bus.to_write > 0U) {
        if ((state & I2C_SR1_TXE) != 0U) {
            bus.to_write--;
            I2C1->dr = *bus.write++;
        }
        return;
    }
    I2C1->cr2 &= ~I2C_CR2_ITBUFEN; /* room alone is no news any more: the last byte is awaited */
    if ((state & I2C_SR1_BTF) == 0U) {
        return;
    }
    if (bus.to_read > 0U) {
        bus.address |= 1U;
        I2C1->cr2 |= I2C_CR2_ITBUFEN;
        I2C1->cr1 |= I2C_CR1_START;
    } else {
        stop(BOARD_I2C_DONE);
    }
}

static void receive(uint32_t state)
{
    if (bus.to_read > 3U || bus.to_read == 1U) {
        take();
        if (bus.to_read == 0U) {
            end(BOARD_I2C_DONE);
        } else if (bus.to_read == 3U) {
            I2C1->cr2 &= ~I2C_CR2_ITBUFEN;
        }
    } else if ((state & I2C_SR1_BTF) != 0U && bus.to_read == 3U) {
        I2C1->cr1 &= ~I2C_CR1_ACK;
        take();
    } else if ((state & I2C_SR1_BTF) != 0U) {
        I2C1->cr1 |= I2C_CR1_STOP;
        take();
        take();
        end(BOARD_I2C_DONE);
    }
}

void i2c1_event_handler(void)
{
    const uint32_t state = I2C1->sr1;
    if ((state & I2C_SR1_SB) != 0U) {
        I2C1->dr = bus.address;
    } else if ((state & I2C_SR1_ADDR) != 0U) {
        if (bus.address % 2U == 1U) {
            addressed_to_read();
        } else {
            clear_address();
        }
    } else if (bus.address % 2U == 0U) {
        if ((state & (I2C_SR1_TXE | I2C_SR1_BTF)) != 0U) {
            transmit(state);
        }
    } else if ((state & I2C_SR1_RXNE) != 0U) {
        receive(state);
    }
}

void i2c1_error_handler(void)
{
    const uint32_t state = I2C1->sr1 & ERRORS;
    I2C1->sr1 &= ~ERRORS; /* each is cleared by a zero */
    if (state == I2C_SR1_AF) {
        stop(BOARD_I2C_NO_ANSWER);
    } else {
        end(BOARD_I2C_FAULT);
    }
}

static void drive(uint32_t line, uint32_t level)
{
    GPIOB->bsrr = level != 0U ? line : line << 16;
}

uint8_t board_i2c_recover(void)
{
    const uint8_t half = bus.recovering++;
    if (half == 0U) {
        I2C1->cr2 &= ~(EVENTS_AND_ERRORS | I2C_CR2_ITBUFEN);
        bus.state = BOARD_I2C_NO_ANSWER;
        drive(SCL | SDA, 1);
        GPIOB->moder = (GPIOB->moder & ~MODE_MASK) | MODE_OUTPUT; /* open drain: high lets go */
    }
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
    bus.recovering = 0;
    GPIOB->moder = (GPIOB->moder & ~MODE_MASK) | MODE_I2C;
    set_up();
    return 1;
}
