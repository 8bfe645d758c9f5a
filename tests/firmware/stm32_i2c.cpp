// The I2C driver of firmware/ports/cortex_m4/stm32f4 on a model of the peripheral, which no emulator at
// hand has.  The model follows RM0368 18.3 and 18.6: what sets and clears SB, ADDR, TXE, RXNE, BTF, AF;
// when the clock is held; which byte an acknowledgement belongs to.  A device with 256 registers answers.
// Arguments: a list of transfers WRITTEN:READ[:FAULT], FAULT n (no such address), w (no acknowledgement
// after the first byte written), b (bus error), h (holds the clock for ever), s (as good, but interrupts
// come late).  Prints a line a transfer: state, bytes read, registers as the device has them.
#include <stdint.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

struct Register {
    uint32_t value = 0;
    uint32_t (*reading)(Register *) = nullptr;
    void (*writing)(Register *, uint32_t) = nullptr;
    operator uint32_t() { return reading != nullptr ? reading(this) : value; }
    uint32_t operator=(uint32_t given)
    {
        if (writing != nullptr) {
            writing(this, given);
        } else {
            value = given;
        }
        return given;
    }
    uint32_t operator|=(uint32_t bits) { return *this = static_cast<uint32_t>(*this) | bits; }
    uint32_t operator&=(uint32_t bits) { return *this = static_cast<uint32_t>(*this) & bits; }
};

#define FACTORLAB_CORTEX_M4_H
static void interrupt_enable(uint32_t) {}
#define volatile
#define uint32_t Register
#include "stm32f4.h"
#undef uint32_t
#undef volatile
#undef RCC
#undef GPIOA
#undef GPIOB
#undef I2C1
static struct rcc rcc;
static struct gpio gpioa, gpiob;
static struct i2c i2c1;
#define RCC (&rcc)
#define GPIOA (&gpioa)
#define GPIOB (&gpiob)
#define I2C1 (&i2c1)

static unsigned events_raised;
void raise_events(uint8_t) { events_raised++; }

#include "i2c.c"

// --- the device ---

static uint8_t device[256];
static uint8_t device_at;    // its register pointer
static bool device_pointed;  // whether the pointer was written since the start
static char fault;

// --- the peripheral ---

enum Phase { IDLE, STARTING, AWAIT_ADDRESS, SENDING_ADDRESS, ADDRESSED, TRANSMIT, RECEIVE, STOPPED_ACK };

static Phase phase;
static bool reading_direction, sr1_seen, shift_full, data_full, this_ack;
static uint8_t data, shift, address;
static unsigned violations;

static void violation(const char *what)
{
    std::fprintf(stderr, "violation: %s\n", what);
    violations++;
}

static void set(uint32_t flag) { i2c1.sr1.value |= flag; }
static void clear(uint32_t flag) { i2c1.sr1.value &= ~flag; }
static bool has(uint32_t flag) { return (i2c1.sr1.value & flag) != 0; }

static uint32_t read_sr1(Register *self)
{
    sr1_seen = true;
    return self->value;
}

static uint32_t read_sr2(Register *self)
{
    if (phase == ADDRESSED && sr1_seen && has(I2C_SR1_ADDR)) {
        clear(I2C_SR1_ADDR);
        phase = reading_direction ? RECEIVE : TRANSMIT;
        if (!reading_direction) {
            set(I2C_SR1_TXE);
        }
    }
    sr1_seen = false;
    return self->value;
}

static void write_sr1(Register *self, uint32_t given)
{
    const uint32_t errors = I2C_SR1_BERR | I2C_SR1_ARLO | I2C_SR1_AF | I2C_SR1_OVR;
    self->value &= given | ~errors;
}

static uint32_t read_dr(Register *)
{
    const uint8_t taken = data;
    if (!data_full) {
        violation("data read that is not there");
    }
    data_full = false;
    clear(I2C_SR1_RXNE | I2C_SR1_BTF);
    if (shift_full) {
        data = shift;
        shift_full = false;
        data_full = true;
        set(I2C_SR1_RXNE);
    }
    return taken;
}

static void write_dr(Register *, uint32_t given)
{
    if (phase == AWAIT_ADDRESS && has(I2C_SR1_SB)) {
        if (!sr1_seen) {
            violation("address without a look at SB");
        }
        clear(I2C_SR1_SB);
        address = static_cast<uint8_t>(given);
        reading_direction = (given & 1U) != 0;
        phase = SENDING_ADDRESS;
    } else if (phase == TRANSMIT && has(I2C_SR1_TXE)) {
        data = static_cast<uint8_t>(given);
        data_full = true;
        clear(I2C_SR1_BTF);
        if (!shift_full) {
            shift = data;
            shift_full = true;
            data_full = false;
        } else {
            clear(I2C_SR1_TXE);
        }
    } else {
        violation("data written that nobody wants");
    }
}

static void write_cr1(Register *self, uint32_t given)
{
    if ((given & I2C_CR1_SWRST) != 0) {
        phase = IDLE;
        i2c1.sr1.value = 0;
        data_full = shift_full = false;
    }
    if ((self->value & I2C_CR1_STOP) != 0 && (given & I2C_CR1_START) != 0) {
        violation("a start before the stop is out");
    }
    self->value = given;
}

static void receive_byte()
{
    const bool asked = (i2c1.cr1.value & I2C_CR1_ACK) != 0;
    const bool acknowledge = (i2c1.cr1.value & I2C_CR1_POS) != 0 ? this_ack : asked;
    this_ack = asked;
    const uint8_t byte = device[device_at++];
    if (data_full) {
        shift = byte;
        shift_full = true;
        set(I2C_SR1_BTF);
    } else {
        data = byte;
        data_full = true;
        set(I2C_SR1_RXNE);
    }
    if (!acknowledge) {
        phase = STOPPED_ACK;
    }
}

static void transmitted()
{
    shift_full = false;
    if (fault == 'w' && device_pointed) {
        clear(I2C_SR1_TXE);
        set(I2C_SR1_AF);
        return;
    }
    if (!device_pointed) {
        device_at = shift;
        device_pointed = true;
    } else {
        device[device_at++] = shift;
    }
    if (data_full) {
        shift = data;
        shift_full = true;
        data_full = false;
        set(I2C_SR1_TXE);
    } else {
        set(I2C_SR1_BTF);
    }
}

static void stop()
{
    i2c1.cr1.value &= ~I2C_CR1_STOP;
    clear(I2C_SR1_TXE | (data_full ? 0 : I2C_SR1_BTF));
    if (phase == RECEIVE) {
        violation("a stop while the device still sends");
    }
    phase = IDLE;
}

// Nine clocks of the bus.
static void byte_time()
{
    const uint32_t control = i2c1.cr1.value;
    switch (phase) {
    case IDLE:
        if ((control & I2C_CR1_START) != 0) {
            phase = STARTING;
        }
        break;
    case STARTING:
        i2c1.cr1.value &= ~I2C_CR1_START;
        clear(I2C_SR1_TXE | I2C_SR1_BTF);
        set(fault == 'b' ? I2C_SR1_BERR : I2C_SR1_SB);
        device_pointed = false;
        phase = AWAIT_ADDRESS;
        break;
    case SENDING_ADDRESS:
        if (fault == 'n') {
            set(I2C_SR1_AF);
            phase = STOPPED_ACK;
        } else if (fault != 'h') {
            set(I2C_SR1_ADDR);
            phase = ADDRESSED;
            this_ack = true;
        }
        break;
    case TRANSMIT:
        if (shift_full) {
            transmitted();
        } else if ((control & I2C_CR1_START) != 0) {
            phase = STARTING;
        }
        break;
    case RECEIVE:
        if (!(data_full && shift_full)) {
            receive_byte();
        }
        break;
    default:
        break;
    }
    if ((i2c1.cr1.value & I2C_CR1_STOP) != 0 && (phase != RECEIVE)) {
        stop();
    }
}

static bool interrupts()
{
    const uint32_t control = i2c1.cr2.value, state = i2c1.sr1.value;
    uint32_t events = I2C_SR1_SB | I2C_SR1_ADDR | I2C_SR1_BTF;
    if ((control & I2C_CR2_ITBUFEN) != 0) {
        events |= I2C_SR1_RXNE | I2C_SR1_TXE;
    }
    if ((control & I2C_CR2_ITEVTEN) != 0 && (state & events) != 0) {
        i2c1_event_handler();
        return true;
    }
    const uint32_t errors = I2C_SR1_BERR | I2C_SR1_ARLO | I2C_SR1_AF | I2C_SR1_OVR;
    if ((control & I2C_CR2_ITERREN) != 0 && (state & errors) != 0) {
        i2c1_error_handler();
        return true;
    }
    return false;
}

static void transfer(unsigned to_write, unsigned to_read)
{
    static uint8_t written[256], read[256];
    for (unsigned k = 0; k < to_write; k++) {
        written[k] = static_cast<uint8_t>(0x20 + 3 * k);
    }
    std::memset(read, 0, sizeof read);
    events_raised = 0;
    board_i2c_start(0x68, written, static_cast<uint8_t>(to_write), read, static_cast<uint8_t>(to_read));
    for (unsigned time = 0; time < 2000; time++) {
        byte_time();
        for (unsigned k = 0; (fault != 's' || time % 3 == 0) && interrupts(); k++) {
            const bool held = phase == TRANSMIT && has(I2C_SR1_BTF);
            if (held && (i2c1.cr1.value & I2C_CR1_START) != 0 && k == 3) {
                byte_time(); // a repeated start takes a few interrupts, not the time of a byte
                byte_time();
            }
            if (k == 50) {
                violation("an interrupt that does not end");
                break;
            }
        }
    }
    std::printf("%u %u ", static_cast<unsigned>(board_i2c_state()), events_raised);
    for (unsigned k = 0; k < to_read; k++) {
        std::printf("%02x", read[k]);
    }
    std::printf(" ");
    for (unsigned k = 0; k + 1 < to_write; k++) {
        std::printf("%02x", device[0x20 + k]);
    }
    std::printf("\n");
}

int main(int count, char **words)
{
    i2c1.sr1.reading = read_sr1;
    i2c1.sr1.writing = write_sr1;
    i2c1.sr2.reading = read_sr2;
    i2c1.dr.reading = read_dr;
    i2c1.dr.writing = write_dr;
    i2c1.cr1.writing = write_cr1;
    i2c_start();
    for (int k = 1; k < count; k++) {
        unsigned to_write = 0, to_read = 0;
        fault = '\0';
        std::sscanf(words[k], "%u:%u:%c", &to_write, &to_read, &fault);
        for (unsigned at = 0; at < 256; at++) {
            device[at] = static_cast<uint8_t>(at * 7 + 1);
        }
        transfer(to_write, to_read);
        if (board_i2c_state() == BOARD_I2C_BUSY || board_i2c_state() == BOARD_I2C_FAULT) {
            unsigned calls = 1;
            while (board_i2c_recover() == 0) {
                calls++;
            }
            std::printf("freed %u\n", calls);
        }
    }
    std::printf("violations %u\n", violations);
    return violations != 0;
}
