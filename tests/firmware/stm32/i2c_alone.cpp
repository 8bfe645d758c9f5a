// The I2C driver of the STM32F4 board on the model of the peripheral; a device with 256 registers answers.
//
// Arguments: transfers WRITTEN:READ[:FAULT], FAULT n (no such address), w (no acknowledgement after the
// first byte written), b (bus error), h (holds the clock for ever), s (none, but interrupts come late).
// Prints a line a transfer: state, events, bytes read, registers as the device has them.
#include <cstdio>
#include <cstring>

#include "i2c_peripheral.hpp"
#include "port.h"

#include "../../../firmware/app/board.h"

struct rcc rcc;
struct gpio gpioa, gpiob;

static unsigned events_raised;
void raise_events(uint8_t) { events_raised++; }
void interrupt_enable(uint32_t) {}

struct Memory : Device {
    uint8_t registers[256];
    uint8_t at = 0;
    bool pointed = false;
    char fault = '\0';

    Answer addressed(uint8_t, bool) override
    {
        pointed = false;
        return fault == 'n' ? NO : fault == 'b' ? BUS_ERROR : fault == 'h' ? HOLDS_CLOCK : YES;
    }
    bool take(uint8_t byte) override
    {
        if (fault == 'w' && pointed) {
            return false;
        }
        if (pointed) {
            registers[at++] = byte;
        } else {
            at = byte;
        }
        pointed = true;
        return true;
    }
    uint8_t give() override { return registers[at++]; }
};

static Memory memory;

static bool interrupted()
{
    if (i2c_wants_event()) {
        i2c1_event_handler();
        return true;
    }
    if (i2c_wants_error()) {
        i2c1_error_handler();
        return true;
    }
    return false;
}

static void interrupts()
{
    for (unsigned k = 0; interrupted(); k++) {
        if (k == 3 && i2c_repeats()) {
            i2c_byte_time();
        }
        if (k == 50) {
            violation("an interrupt that does not end");
            return;
        }
    }
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
        i2c_byte_time();
        if (memory.fault != 's' || time % 3 == 0) {
            interrupts();
        }
    }
    std::printf("%u %u ", static_cast<unsigned>(board_i2c_state()), events_raised);
    for (unsigned k = 0; k < to_read; k++) {
        std::printf("%02x", read[k]);
    }
    std::printf(" ");
    for (unsigned k = 0; k + 1 < to_write; k++) {
        std::printf("%02x", memory.registers[0x20 + k]);
    }
    std::printf("\n");
}

int main(int count, char **words)
{
    i2c_connect(&memory);
    i2c_start();
    for (int k = 1; k < count; k++) {
        unsigned to_write = 0, to_read = 0;
        memory.fault = '\0';
        std::sscanf(words[k], "%u:%u:%c", &to_write, &to_read, &memory.fault);
        for (unsigned at = 0; at < 256; at++) {
            memory.registers[at] = static_cast<uint8_t>(at * 7 + 1);
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
