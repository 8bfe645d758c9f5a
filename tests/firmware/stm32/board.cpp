// The whole board file of the STM32F4 on models of its peripherals, a recording as the sensor on its bus.
//
//     board ROWS BYTES TIMES [hse] [pll]
//
// reads rows of firmware/ports/recorded/sensor.h, writes what the serial line carries and, for each byte, the
// number of ticks before it and its time since the last one (two uint32, clocks of the core).  `hse`, `pll`:
// that oscillator never comes.  Prints clocks, baud, rate of the bus and the state of the pins.  The processor
// itself takes no time here.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "i2c_peripheral.hpp"
#include "port.h"
#include "recorded_device.hpp"

#include "../../../firmware/app/app.h"
#include "../../../firmware/app/board.h"

struct systick systick;
struct rcc rcc;
struct gpio gpioa, gpiob;
struct tim tim2;
struct usart usart2;
Register flash_acr;

static FILE *rows, *bytes, *times;
static bool over;

#include "clocks.hpp"

// --- interrupts: one at a time, none while masked ---

static bool masked, handling, enabled[64], pended[64], ticked;
static uint32_t ticks;
static uint64_t now, last_tick; // clocks of the core

void interrupt_enable(uint32_t number) { enabled[number] = true; }
void interrupt_pend(uint32_t number) { pended[number] = true; }

static bool due(uint32_t number, bool wanted) { return enabled[number] && (wanted || pended[number]); }

static bool serve(uint32_t number, bool wanted, void (*handler)())
{
    if (!due(number, wanted)) {
        return false;
    }
    pended[number] = false;
    handler();
    return true;
}

static bool uart_wants()
{
    const uint32_t state = usart2.sr.value, control = usart2.cr1.value;
    return ((state & USART_SR_TXE) != 0 && (control & USART_CR1_TXEIE) != 0) ||
           ((state & USART_SR_RXNE) != 0 && (control & USART_CR1_RXNEIE) != 0);
}

static bool tim2_wants() { return (tim2.sr.value & 1U) != 0 && (tim2.dier.value & TIM_DIER_UIE) != 0; }

static bool serve_one()
{
    if (ticked) {
        ticked = false;
        systick_handler();
        return true;
    }
    return serve(TIM2_IRQ, tim2_wants(), tim2_handler) ||
           serve(I2C1_EV_IRQ, i2c_wants_event(), i2c1_event_handler) ||
           serve(I2C1_ER_IRQ, i2c_wants_error(), i2c1_error_handler) ||
           serve(USART2_IRQ, uart_wants(), usart2_handler);
}

static void deliver()
{
    if (masked || handling) {
        return;
    }
    handling = true;
    for (unsigned k = 0; serve_one(); k++) {
        if (k >= 3 && i2c_repeats()) {
            i2c_byte_time();
        }
        if (k == 100) {
            violation("an interrupt that does not end");
            break;
        }
    }
    handling = false;
}

void interrupts_off() { masked = !handling || masked; }
void interrupts_on()
{
    masked = handling && masked;
    deliver();
}

// --- TIM2, one shot ---

static uint64_t tim2_began;

static void write_egr(Register *, uint32_t) { tim2_began = now; }
static void write_tim2_cr1(Register *self, uint32_t given)
{
    if ((given & TIM_CR1_CEN) != 0 && (self->value & TIM_CR1_CEN) == 0) {
        tim2_began = now;
    }
    self->value = given;
}

static void tim2_step()
{
    if ((tim2.cr1.value & TIM_CR1_CEN) != 0 && now - tim2_began >= tim2.arr.value + 1U) {
        tim2.sr.value |= 1U;
        if ((tim2.cr1.value & TIM_CR1_OPM) != 0) {
            tim2.cr1.value &= ~TIM_CR1_CEN;
        }
        tim2_began = now;
    }
}

#include "serial_line.hpp"

// --- time ---

static RecordedDevice sensor;
static uint64_t next_byte; // when the bus has moved on by a byte

static void systick_step()
{
    if ((systick.ctrl.value & 1U) != 0 && now - last_tick >= systick.load.value + 1U) {
        last_tick = now;
        ticks++;
        ticked = true;
        over = over || recorded_tick() == 0;
        if (!over && recorded_command() != 0) {
            arrive(recorded_command());
        }
    }
}

void wait_for_interrupt()
{
    static const unsigned STEP = 42; // clocks: half a microsecond
    if (!masked) {
        violation("sleep with interrupts on, so that one may slip in before");
    }
    while (!over && !ticked && !due(TIM2_IRQ, tim2_wants()) && !due(USART2_IRQ, uart_wants()) &&
           !due(I2C1_EV_IRQ, i2c_wants_event()) && !due(I2C1_ER_IRQ, i2c_wants_error())) {
        now += STEP;
        systick_step();
        tim2_step();
        usart_step();
        if (now >= next_byte) {
            const double bit = 3.0 * (i2c1.ccr.value & 0xFFFU) * hclk() / apb1();
            next_byte = now + static_cast<uint64_t>(std::llround(9.0 * bit));
            i2c_byte_time();
        }
    }
    if (over) {
        std::fclose(bytes);
        std::fclose(times);
        std::printf("violations %u\n", violations);
        std::exit(violations != 0);
    }
}

extern "C" size_t read_rows(struct recorded_row *into, size_t count)
{
    return std::fread(into, sizeof into[0], count, rows);
}

static unsigned alternate(const struct gpio &port, unsigned pin)
{
    const bool chosen = (port.moder.value >> (2 * pin) & 3U) == GPIO_ALTERNATE;
    return chosen ? port.afr[pin / 8].value >> (4 * (pin % 8)) & 15U : 99U;
}

int main(int count, char **words)
{
    if (count < 4) {
        return 2;
    }
    rows = std::fopen(words[1], "rb");
    bytes = std::fopen(words[2], "wb");
    times = std::fopen(words[3], "wb");
    for (int k = 4; k < count; k++) {
        no_hse = no_hse || std::strcmp(words[k], "hse") == 0;
        no_pll = no_pll || std::strcmp(words[k], "pll") == 0;
    }
    rcc.cr.writing = write_cr;
    rcc.cfgr.writing = write_cfgr;
    tim2.egr.writing = write_egr;
    tim2.cr1.writing = write_tim2_cr1;
    usart2.sr.value = USART_SR_TXE;
    usart2.dr.reading = read_dr;
    usart2.dr.writing = write_dr;
    gpioa.moder.value = 0xA8000000U; // after reset: debugging
    i2c_connect(&sensor);
    recorded_start(read_rows);
    board_start();
    std::printf("core %.0f\n", hclk());
    std::printf("apb1 %.0f\n", apb1());
    std::printf("baud %.0f\n", apb1() / usart2.brr.value);
    std::printf("bus %.0f\n", apb1() / (3.0 * (i2c1.ccr.value & 0xFFFU)));
    std::printf("rise %.0f\n", (i2c1.trise.value - 1) * 1e9 / apb1());
    std::printf("frequency %u\n", i2c1.cr2.value & 63U);
    std::printf("pins %u %u ", alternate(gpioa, 2), alternate(gpioa, 3));
    std::printf("%u %u\n", alternate(gpiob, 8), alternate(gpiob, 9));
    std::printf("drain %u\n", gpiob.otyper.value >> 8 & 3U);
    std::printf("debug %u\n", gpioa.moder.value >> 26);
    app_start();
    for (;;) {
        app_step(board_wait());
    }
}
