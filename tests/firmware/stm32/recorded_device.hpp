// The sensor of a recording on a bus that goes byte by byte: what is read is fetched when its address comes.
#ifndef FACTORLAB_TEST_STM32_RECORDED_DEVICE_HPP
#define FACTORLAB_TEST_STM32_RECORDED_DEVICE_HPP

#include "i2c_peripheral.hpp"

#include "../../../firmware/app/board.h"
extern "C" {
#include "../../../firmware/ports/recorded/sensor.h"
}

struct RecordedDevice : Device {
    uint8_t written[16], read[128];
    uint8_t count = 0, at = 0;

    Answer addressed(uint8_t address, bool reading) override
    {
        at = 0;
        if (!reading) {
            count = 0;
            const uint8_t identity = 0x75; // reading it tells whether the sensor answers in this period
            return answer(recorded_transfer(address, &identity, 1, read, 1));
        }
        const uint8_t length = written[0] == 0x3B ? 14 : static_cast<uint8_t>(written[0] == 0x19 ? 4 : 1);
        return answer(recorded_transfer(address, written, 1, read, length));
    }
    bool take(uint8_t byte) override
    {
        written[count++ & 15U] = byte;
        return true;
    }
    uint8_t give() override { return read[at++ & 127U]; }
    void stopped() override
    {
        if (count > 1) {
            (void)recorded_transfer(0x68, written, count, read, 0);
        }
        count = 0;
    }
    static Answer answer(uint8_t state)
    {
        return state == BOARD_I2C_DONE ? YES : state == BOARD_I2C_BUSY ? HOLDS_CLOCK
               : state == BOARD_I2C_FAULT ? BUS_ERROR : NO;
    }
};

#endif
