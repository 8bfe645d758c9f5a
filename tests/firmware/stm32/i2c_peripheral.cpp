#include "i2c_peripheral.hpp"

#include <cstdio>
#include <cstdlib>

enum Phase { IDLE, STARTING, AWAIT_ADDRESS, SENDING_ADDRESS, ADDRESSED, TRANSMIT, RECEIVE, REFUSED };

struct i2c i2c1;
unsigned violations;

static Device *device;
static Phase phase;
static bool reading_direction, sr1_seen, shift_full, data_full, this_ack;
static uint8_t data, shift, address;

void violation(const char *what)
{
    std::fprintf(stderr, "violation: %s\n", what);
    if (++violations == 20) {
        std::exit(1);
    }
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

void i2c_connect(Device *given)
{
    device = given;
    i2c1.sr1.reading = read_sr1;
    i2c1.sr1.writing = write_sr1;
    i2c1.sr2.reading = read_sr2;
    i2c1.dr.reading = read_dr;
    i2c1.dr.writing = write_dr;
    i2c1.cr1.writing = write_cr1;
}

static void receive_byte()
{
    const bool asked = (i2c1.cr1.value & I2C_CR1_ACK) != 0;
    const bool acknowledge = (i2c1.cr1.value & I2C_CR1_POS) != 0 ? this_ack : asked;
    const uint8_t byte = device->give();
    this_ack = asked;
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
        phase = REFUSED;
    }
}

static void transmitted()
{
    shift_full = false;
    if (!device->take(shift)) {
        clear(I2C_SR1_TXE);
        set(I2C_SR1_AF);
    } else if (data_full) {
        shift = data;
        shift_full = true;
        data_full = false;
        set(I2C_SR1_TXE);
    } else {
        set(I2C_SR1_BTF);
    }
}

static void addressing()
{
    switch (device->addressed(address >> 1, reading_direction)) {
    case Device::YES:
        set(I2C_SR1_ADDR);
        phase = ADDRESSED;
        this_ack = true;
        break;
    case Device::NO:
        set(I2C_SR1_AF);
        phase = REFUSED;
        break;
    case Device::BUS_ERROR:
        set(I2C_SR1_BERR);
        phase = REFUSED;
        break;
    case Device::HOLDS_CLOCK:
        break;
    }
}

static void stop()
{
    i2c1.cr1.value &= ~I2C_CR1_STOP;
    clear(I2C_SR1_TXE | (data_full ? 0 : I2C_SR1_BTF));
    phase = IDLE;
    device->stopped();
}

static void start()
{
    i2c1.cr1.value &= ~I2C_CR1_START;
    clear(I2C_SR1_TXE | I2C_SR1_BTF);
    set(I2C_SR1_SB);
    phase = AWAIT_ADDRESS;
}

void i2c_byte_time()
{
    const uint32_t control = i2c1.cr1.value;
    switch (phase) {
    case IDLE:
        if ((control & I2C_CR1_START) != 0) {
            phase = STARTING;
        }
        break;
    case STARTING:
        start();
        break;
    case SENDING_ADDRESS:
        addressing();
        break;
    case TRANSMIT:
        if (shift_full) {
            transmitted();
        } else if ((control & I2C_CR1_START) != 0) {
            start();
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
    if ((i2c1.cr1.value & I2C_CR1_STOP) != 0) {
        if (phase == RECEIVE) {
            violation("a stop while the device still sends");
        }
        stop();
    }
}

bool i2c_repeats()
{
    return phase == TRANSMIT && has(I2C_SR1_BTF) && (i2c1.cr1.value & I2C_CR1_START) != 0;
}

bool i2c_wants_event()
{
    uint32_t events = I2C_SR1_SB | I2C_SR1_ADDR | I2C_SR1_BTF;
    if ((i2c1.cr2.value & I2C_CR2_ITBUFEN) != 0) {
        events |= I2C_SR1_RXNE | I2C_SR1_TXE;
    }
    return (i2c1.cr2.value & I2C_CR2_ITEVTEN) != 0 && has(events);
}

bool i2c_wants_error()
{
    const uint32_t errors = I2C_SR1_BERR | I2C_SR1_ARLO | I2C_SR1_AF | I2C_SR1_OVR;
    return (i2c1.cr2.value & I2C_CR2_ITERREN) != 0 && has(errors);
}
