// A model of the I2C peripheral after RM0368 18.3 and 18.6: what sets and clears SB, ADDR, TXE, RXNE, BTF,
// AF; when the clock is held; which byte an acknowledgement belongs to.  Time goes by bytes: `byte_time` is
// nine clocks.
#ifndef FACTORLAB_TEST_STM32_I2C_HPP
#define FACTORLAB_TEST_STM32_I2C_HPP

#include "registers.hpp"

// What hangs on the bus.
struct Device {
    enum Answer { YES, NO, HOLDS_CLOCK, BUS_ERROR };
    virtual Answer addressed(uint8_t address, bool reading) = 0;
    virtual bool take(uint8_t byte) = 0; // whether it acknowledges
    virtual uint8_t give() = 0;
    virtual void stopped() {}
    virtual ~Device() = default;
};

void i2c_connect(Device *device);
void i2c_byte_time();
bool i2c_repeats(); // a repeated start is due, which takes less than a byte
bool i2c_wants_event();
bool i2c_wants_error();
extern unsigned violations;
void violation(const char *what);

#endif
