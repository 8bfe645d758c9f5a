/* The board of app/board.h on QEMU's mps2-an386: UART0 with interrupts, an I2C bus that a recording answers.
 *
 * A period follows the one before as soon as nothing is left to do (CLOCK=recording), or SysTick says so
 * (CLOCK=systick).  There is no WFI: under -icount QEMU would sleep it out in the computer's time.  What the
 * UART is given leaves at once; it has no baud rate here.
 * Semihosting arguments: 1 the rows (recorded/sensor.h), 2 the log (log.h), 3 the first command, one letter.
 */
#include "../../../app/board.h"

#include "../../../core/frame.h"
#include "../../recorded/sensor.h"
#include "../cortex_m4.h"
#include "../ring.h"
#include "../startup.h"
#include "cmsdk.h"
#include "log.h"
#include "semihosting.h"
#include "stack.h"

#define ROWS 1U
#define LOG 2U
#define COMMAND 3U
#define BAUD 115200UL

struct board {
    struct ring out, in;
    struct log_period *log;
    uint32_t ticks;             /* periods since the start, the present one included */
    uint32_t taken;             /* of these, given to the application */
    uint32_t sent;              /* bytes handed to the UART */
    int32_t rows;               /* file of the recording */
    volatile uint8_t events;    /* BOARD_TICK ... */
    volatile uint8_t first_due; /* 1: no byte has left in this period */
    uint8_t transfer;           /* BOARD_I2C_DONE ... */
};

const uint8_t board_target = BOOT_MPS2_AN386;
static struct board board;

static uint32_t now(void)
{
    return UINT32_MAX - TIMER0->value;
}

static size_t read_rows(struct recorded_row *rows, size_t count)
{
    return semihost_read(board.rows, rows, count * sizeof rows[0]) / sizeof rows[0];
}

static void raise_event(uint8_t event)
{
    interrupts_off();
    board.events = (uint8_t)(board.events | event);
    interrupts_on();
}

static void receive(uint8_t byte)
{
    (void)ring_put(&board.in, &byte, 1);
    board.events |= BOARD_RECEIVED;
}

static void uart_handler(void)
{
    UART0->interrupt = UART_INTERRUPT_BOTH;
    while ((UART0->state & UART_BUFFER_HELD) != 0U) {
        receive((uint8_t)UART0->data);
    }
    while (!ring_is_empty(&board.out) && (UART0->state & UART_BUFFER_FULL) == 0U) {
        if (board.first_due != 0U) {
            board.log->first_byte = now();
            board.first_due = 0;
        }
        UART0->data = (uint32_t)ring_take(&board.out);
        board.sent++;
    }
}

static void tick_handler(void)
{
    const uint32_t at = now();
    board.ticks++;
    board.log = log_next();
    board.log->tick = at;
    board.log->sent = board.sent;
    board.first_due = 1;
    board.events |= BOARD_TICK;
}

static void finish(void)
{
    board.log = log_next();
    board.log->row = LOG_STACK;
    board.log->tick = stack_used();
    log_flush();
    semihost_exit(0);
}

/* Nothing is left to do in this period. */
static void idle(void)
{
#if CLOCK_SYSTICK == 0
    if (ring_is_empty(&board.out)) {
        TIMER0->value = UINT32_MAX; /* a count of 32 bits does not last for the recording */
        interrupts_off();
        tick_handler();
        interrupts_on();
    }
#endif
}

/* A pair of marks without an update between them. */
static void log_empty(void)
{
    board.log = log_next();
    board.log->row = LOG_EMPTY;
    board_mark_update(1);
    board_mark_update(0);
}

void board_start(void)
{
    char command = '\0';
    stack_paint();
    TIMER0->reload = UINT32_MAX;
    TIMER0->value = UINT32_MAX;
    TIMER0->ctrl = 1;
    board.rows = semihost_open(ROWS, SEMIHOST_READ);
    log_start(LOG);
    log_empty();
    recorded_start(read_rows);
    UART0->divider = CMSDK_CLOCK_HZ / BAUD;
    UART0->ctrl = UART_RUN;
    interrupt_enable(UART0_RX_IRQ);
    interrupt_enable(UART0_TX_IRQ);
    if (semihost_argument(COMMAND, &command, 1) != 0U) {
        receive((uint8_t)command);
    }
#if CLOCK_SYSTICK
    SYSTICK->load = CMSDK_CLOCK_HZ / BOARD_RATE_HZ - 1U;
    SYSTICK->value = 0;
    SYSTICK->ctrl = SYSTICK_RUN;
#endif
}

/* What the recording says of a period that begins. */
static void begin_period(void)
{
    if (recorded_tick() == 0) {
        finish();
    }
    board.log->row = recorded_row();
    if (recorded_command() != 0U) {
        interrupts_off();
        receive(recorded_command());
        interrupts_on();
    }
}

uint8_t board_wait(void)
{
    while (board.events == 0U) {
        idle();
    }
    interrupts_off();
    const uint8_t events = board.events;
    board.events = 0;
    interrupts_on();
    if ((events & BOARD_TICK) != 0U) {
        begin_period();
    }
    return events;
}

uint8_t board_periods(void)
{
    const uint32_t periods = board.ticks - board.taken;
    board.taken += periods;
    return (uint8_t)periods;
}

uint32_t board_time_us(void)
{
    return board.taken * BOARD_PERIOD_US;
}

void board_phase(uint8_t after)
{
    (void)after; /* what is written leaves at once */
}

void board_i2c_start(uint8_t address, const uint8_t *write, uint8_t write_length, uint8_t *read,
                     uint8_t read_length)
{
    board.transfer = recorded_transfer(address, write, write_length, read, read_length);
    board.log->row = recorded_row();
    if (board.transfer == BOARD_I2C_BUSY) {
        return;
    }
    if (board.transfer == BOARD_I2C_DONE) {
        board.log->sample = now();
    }
    raise_event(BOARD_I2C);
}

uint8_t board_i2c_state(void)
{
    return board.transfer;
}

uint8_t board_i2c_recover(void)
{
    board.transfer = BOARD_I2C_DONE;
    return 1;
}

/* The interrupt is asked for, not awaited: its handler is the only place that feeds the UART. */
uint8_t board_write(const uint8_t *bytes, uint8_t length)
{
    const uint8_t written = ring_put(&board.out, bytes, length);
    interrupt_pend(UART0_TX_IRQ);
    return written;
}

uint8_t board_room(void)
{
    return ring_room(&board.out);
}

int16_t board_received(void)
{
    return ring_take(&board.in);
}

void board_mark_update(uint8_t level)
{
    if (level != 0U) {
        board.log->update_start = now();
    } else {
        board.log->update_end = now();
    }
}

__attribute__((section(".vectors"), used)) static const handler vectors[16 + 2] = {
    (handler)stack_top, reset_handler,   default_handler, default_handler, default_handler, default_handler,
    default_handler,    default_handler, default_handler, default_handler, default_handler, default_handler,
    default_handler,    default_handler, default_handler, tick_handler,    uart_handler,    uart_handler,
};
