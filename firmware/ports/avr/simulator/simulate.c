/* Runs an image for the ATmega328P on recorded samples, and writes down when what came out.
 *
 *     simulate IMAGE.elf SAMPLES RECORDS [--send BYTES] [--faults FILE] [--who-am-i N] [--real-time]
 *
 * SAMPLES: int16 little endian, rows ax ay az temperature gx gy gz, 100 a second, served as by an MPU-6050.
 * RECORDS: a `struct record` for each byte on the serial line, edge of the marker pins, row served, and
 *     change of what the program itself pulls low on the bus.
 * --send: bytes that the board receives once it has said something.
 * --faults: one byte a row (slave.h).
 * --real-time: no faster than a board; the serial line is a pseudo-terminal, whose name is printed first;
 *     RECORDS may be /dev/null.
 * Printed at the end, as one JSON object: cycles run, cycles asleep, bytes of stack used, rows served.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_elf.h>

#include "bridge.h"
#include "slave.h"

#define CLOCK_HZ 16000000UL
#define PERIOD (CLOCK_HZ / 100UL) /* cycles a row */
#define START_PERIODS 50UL        /* by then a sensor that answers has been read */
#define UNTOUCHED 0xC5            /* fills the RAM, so that the stack leaves a mark */

enum { BYTE = 'B', SAMPLE_PIN = 'S', UPDATE_PIN = 'U', ROW = 'R', BUS_PINS = 'D' /* port C pulled low */ };

struct record {
    uint64_t cycle;
    uint32_t row;
    uint8_t kind, value;
    uint16_t unused;
};

static avr_t *avr;
static FILE *records;
static uint64_t asleep; /* cycles */
static uint64_t served; /* rows */
static const char *commands = "";
static struct bridge bridge;

static void note(uint8_t kind, uint8_t value, uint32_t row)
{
    struct record record = {avr->cycle, row, kind, value, 0};
    fwrite(&record, sizeof record, 1, records);
}

static void on_row(uint32_t row)
{
    served++;
    note(ROW, 0, row);
}

static void receive(uint8_t byte)
{
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), byte);
}

static void on_byte(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    note(BYTE, (uint8_t)value, 0);
    bridge_write(&bridge, (uint8_t)value);
    while (*commands != '\0') {
        receive((uint8_t)*commands++);
    }
}

static void on_pin(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    note(*(const uint8_t *)param, (uint8_t)value, 0);
}

static void on_sleep(avr_t *which, avr_cycle_count_t cycles)
{
    asleep += cycles + 1U; /* simavr counts the sleep instruction itself as one more */
    bridge_keep_pace(&bridge, which->cycle, receive);
}

static void silent(avr_t *which, const int level, const char *format, va_list arguments)
{
    (void)which;
    if (level <= LOG_ERROR) {
        vfprintf(stderr, format, arguments);
    }
}

static void watch(void)
{
    static const uint8_t sample = SAMPLE_PIN, update = UPDATE_PIN, bus = BUS_PINS;
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags); /* nothing on the console */
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 0), on_pin, (void *)&sample);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 1), on_pin, (void *)&update);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), IOPORT_IRQ_DIRECTION_ALL),
                            on_pin, (void *)&bus);
    avr->sleep = on_sleep;
}

static void load(const char *path)
{
    elf_firmware_t image;
    memset(&image, 0, sizeof image);
    avr = avr_make_mcu_by_name("atmega328p");
    if (avr == NULL || elf_read_firmware(path, &image) != 0) {
        fprintf(stderr, "simulate: %s is not an image for an AVR that can be read\n", path);
        exit(1);
    }
    avr_init(avr);
    avr_load_firmware(avr, &image);
    avr->frequency = CLOCK_HZ;
    memset(avr->data + 0x100 + image.datasize + image.bsssize, UNTOUCHED,
           avr->ramend + 1U - (0x100 + image.datasize + image.bsssize));
}

/* Bytes from the end of the RAM down to the last one that is still as it was filled. */
static unsigned stack_used(void)
{
    unsigned at = avr->ramend, lowest = avr->ramend + 1U, untouched = 0;
    for (; at >= 0x100 && untouched < 64; at--) {
        untouched = avr->data[at] == UNTOUCHED ? untouched + 1U : 0;
        lowest = untouched == 0 ? at : lowest;
    }
    return avr->ramend + 1U - lowest;
}

static void *whole(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    void *bytes;
    if (file == NULL || fseek(file, 0, SEEK_END) != 0) {
        fprintf(stderr, "simulate: cannot read %s\n", path);
        exit(1);
    }
    *size = (size_t)ftell(file);
    rewind(file);
    bytes = malloc(*size + 1U);
    if (bytes == NULL || fread(bytes, 1, *size, file) != *size) {
        fprintf(stderr, "simulate: cannot read %s\n", path);
        exit(1);
    }
    fclose(file);
    return bytes;
}

static uint64_t last_cycle(const struct slave *slave)
{
    uint64_t rows = slave->rows * PERIOD;
    return slave->first != 0 ? slave->first + rows - 1U : rows + START_PERIODS * PERIOD;
}

int main(int argc, char **argv)
{
    static struct slave slave = {.period = PERIOD, .served = on_row};
    uint8_t who_am_i = 0x68;
    size_t size;
    int state = cpu_Running;
    if (argc < 4) {
        fprintf(stderr, "usage: simulate IMAGE.elf SAMPLES RECORDS [--send BYTES] [--faults FILE] "
                        "[--who-am-i N] [--real-time]\n");
        return 2;
    }
    slave.counts = whole(argv[2], &size);
    slave.rows = size / sizeof *slave.counts;
    records = fopen(argv[3], "wb");
    if (records == NULL) {
        fprintf(stderr, "simulate: cannot write %s\n", argv[3]);
        return 1;
    }
    for (int k = 4; k < argc; k++) {
        const char *next = k + 1 < argc ? argv[k + 1] : "";
        if (strcmp(argv[k], "--real-time") == 0) {
            bridge_open(&bridge, CLOCK_HZ);
        } else if (strcmp(argv[k], "--send") == 0) {
            commands = next;
            k++;
        } else if (strcmp(argv[k], "--faults") == 0) {
            slave.faults = whole(next, &size);
            k++;
        } else if (strcmp(argv[k], "--who-am-i") == 0) {
            who_am_i = (uint8_t)strtoul(next, NULL, 0);
            k++;
        }
    }
    avr_global_logger_set(silent);
    load(argv[1]);
    watch();
    slave_attach(&slave, avr, who_am_i);
    while (state != cpu_Done && state != cpu_Crashed && avr->cycle < last_cycle(&slave)) {
        state = avr_run(avr);
    }
    printf("{\"cycles\": %llu, \"asleep\": %llu, \"stack\": %u, \"rows\": %llu, \"crashed\": %s}\n",
           (unsigned long long)avr->cycle, (unsigned long long)asleep, stack_used(),
           (unsigned long long)served, state == cpu_Done || state == cpu_Crashed ? "true" : "false");
    return fclose(records) == 0 ? 0 : 1;
}
