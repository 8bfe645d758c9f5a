#include "slave.h"

#include <stdlib.h>
#include <string.h>

#define ADDRESS 0x68U
#define FIRST_COUNT 0x3BU
#define POWER 0x6BU
#define IDENTITY 0x75U
#define POWER_AFTER_RESET 0x40U /* asleep */

/* The row whose time this is. */
static size_t row_now(const struct slave *slave)
{
    uint64_t since = slave->avr->cycle - slave->first;
    return slave->first == 0 ? 0 : (size_t)((since + slave->period / 2) / slave->period);
}

static enum slave_fault fault_now(const struct slave *slave)
{
    size_t row = row_now(slave);
    return slave->faults == NULL || slave->first == 0 || row >= slave->rows ? SLAVE_GOOD : slave->faults[row];
}

static void load_row(struct slave *slave)
{
    size_t row;
    if (slave->first == 0) {
        slave->first = slave->avr->cycle;
    }
    row = row_now(slave);
    if (row >= slave->rows) {
        return;
    }
    for (size_t k = 0; k < 7; k++) {
        uint16_t count = (uint16_t)slave->counts[row][k];
        slave->registers[FIRST_COUNT + 2 * k] = (uint8_t)(count >> 8);
        slave->registers[FIRST_COUNT + 2 * k + 1] = (uint8_t)count;
    }
    slave->served((uint32_t)row);
}

static void answer(struct slave *slave, uint8_t what, uint8_t data)
{
    avr_raise_irq(slave->bus + TWI_IRQ_INPUT, avr_twi_irq_msg(what, slave->chosen, data));
}

static void written(struct slave *slave, uint8_t value)
{
    if (!slave->named) {
        slave->named = 1;
        slave->pointer = value & 0x7FU;
    } else {
        if (slave->pointer == POWER && (value & 0x80U) != 0) {
            value = POWER_AFTER_RESET;
        }
        if (slave->pointer != IDENTITY) {
            slave->registers[slave->pointer] = value;
        }
        slave->pointer = (slave->pointer + 1U) & 0x7FU;
    }
    answer(slave, TWI_COND_ACK, 1);
}

/* The unit's next interrupt, which is due at once or in nine bits. */
static avr_cycle_timer_slot_t *due(const struct slave *slave)
{
    avr_cycle_timer_slot_t *slot = slave->avr->cycle_timers.timer;
    while (slot != NULL && slot->param != slave->unit) {
        slot = slot->next;
    }
    return slot;
}

/* simavr 1.6 gives a byte nine microseconds; it takes nine bits, of what the bit rate register says. */
static avr_cycle_count_t keep_time(avr_t *avr, avr_cycle_count_t when, void *param)
{
    const struct slave *slave = param;
    const avr_twi_t *unit = slave->unit;
    avr_cycle_timer_slot_t *slot = due(slave);
    uint8_t prescaler = avr_regbit_get(avr, unit->twps);
    avr_cycle_count_t bit = 16U + 2U * avr->data[unit->r_twbr] * (1UL << (2U * prescaler));
    (void)when;
    if (slot != NULL) {
        avr_cycle_timer_t then = slot->timer;
        avr_cycle_timer_cancel(avr, then, slot->param);
        if (!slave->hangs) {
            avr_cycle_timer_register(avr, 9U * bit - 1U, then, slave->unit);
        }
    }
    return 0;
}

static void on_bus(avr_irq_t *irq, uint32_t value, void *param)
{
    struct slave *slave = param;
    avr_twi_msg_irq_t message = {.u.v = value};
    uint8_t what = message.u.twi.msg;
    (void)irq;
    if (what & TWI_COND_STOP) {
        slave->chosen = 0;
        return;
    }
    avr_cycle_timer_register(slave->avr, 1, keep_time, slave);
    if (what & TWI_COND_START) {
        enum slave_fault fault = fault_now(slave);
        uint8_t ours = (message.u.twi.addr >> 1) == ADDRESS;
        slave->chosen = ours && fault != SLAVE_ABSENT ? message.u.twi.addr : 0;
        slave->named = 0;
        slave->hangs = fault == SLAVE_HUNG;
        if (slave->chosen) {
            if (message.u.twi.addr & 1U && slave->pointer == FIRST_COUNT) {
                load_row(slave);
            }
            answer(slave, TWI_COND_ACK, 1);
        }
    }
    if (slave->chosen && what & TWI_COND_WRITE) {
        written(slave, message.u.twi.data);
    }
    if (slave->chosen && what & TWI_COND_READ) {
        answer(slave, TWI_COND_READ, slave->registers[slave->pointer]);
        slave->pointer = (slave->pointer + 1U) & 0x7FU;
    }
}

void slave_attach(struct slave *slave, avr_t *avr, uint8_t who_am_i)
{
    slave->avr = avr;
    slave->bus = avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT);
    for (avr_io_t *io = avr->io_port; io != NULL; io = io->next) {
        if (strcmp(io->kind, "twi") == 0) {
            slave->unit = (avr_twi_t *)io;
        }
    }
    memset(slave->registers, 0, sizeof slave->registers);
    slave->registers[POWER] = POWER_AFTER_RESET;
    slave->registers[IDENTITY] = who_am_i;
    avr_irq_register_notify(slave->bus + TWI_IRQ_OUTPUT, on_bus, slave);
}
