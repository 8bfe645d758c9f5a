/* The board of app/board.h on an STM32F4: SysTick begins a period, TIM2 its phase, the core sleeps between.
 *
 * After a tick nothing begins to leave on the serial line before the phase, PHASE_..._US later: the burst of
 * the sensor takes 0.4 ms, and the update less than what is left, so that frames leave evenly whatever the
 * filter had to do.
 */
#include "../../../app/board.h"

#include "../../../core/frame.h"
#include "port.h"

#ifndef PHASE
#define PHASE 1 /* 0: frames leave as soon as they are there */
#endif
#ifndef PHASE_UPDATE_US
#define PHASE_UPDATE_US 600UL
#endif
#ifndef PHASE_ANGLES_US
#define PHASE_ANGLES_US 650UL
#endif

const uint8_t board_target = BOOT_STM32F4;

static volatile uint8_t pending; /* BOARD_TICK ... */
static volatile uint8_t begun;   /* periods that began since board_periods */
static uint32_t time_us;         /* us, start of the present period */

void raise_events(uint8_t events)
{
    interrupts_off();
    pending = (uint8_t)(pending | events);
    interrupts_on();
}

void systick_handler(void)
{
#if PHASE
    serial_release(); /* a phase that never came: late is better than never */
    serial_hold();
    TIM2->egr = TIM_EGR_UG; /* from zero */
    TIM2->cr1 = TIM_CR1_CEN | TIM_CR1_OPM | TIM_CR1_URS;
#endif
    begun++;
    raise_events(BOARD_TICK);
}

void tim2_handler(void)
{
    TIM2->sr = 0;
    serial_release();
}

void board_phase(uint8_t after)
{
    TIM2->arr = (after == BOARD_AFTER_ANGLES ? PHASE_ANGLES_US : PHASE_UPDATE_US) * (CORE_HZ / 1000000UL);
}

static void ticks_start(void)
{
    RCC->apb1enr |= RCC_APB1_TIM2;
    TIM2->cr1 = TIM_CR1_OPM | TIM_CR1_URS;
    board_phase(BOARD_AFTER_UPDATE);
    TIM2->dier = TIM_DIER_UIE;
    interrupt_enable(TIM2_IRQ);
    SYSTICK->load = CORE_HZ / BOARD_RATE_HZ - 1UL;
    SYSTICK->value = 0;
    SYSTICK->ctrl = SYSTICK_RUN;
}

void board_start(void)
{
    clock_start();
    RCC->ahb1enr |= RCC_AHB1_GPIOA | RCC_AHB1_GPIOB;
    GPIOA->moder |= (GPIO_OUTPUT << 16) | (GPIO_OUTPUT << 18); /* marks */
    serial_start();
    i2c_start();
    ticks_start();
}

uint8_t board_wait(void)
{
    uint8_t taken;
    interrupts_off();
    while ((taken = pending) == 0U) {
        wait_for_interrupt(); /* a masked interrupt wakes it as well: none can slip in before */
        interrupts_on();
        interrupts_off();
    }
    pending = 0;
    interrupts_on();
    return taken;
}

uint8_t board_periods(void)
{
    interrupts_off();
    const uint8_t periods = begun;
    begun = 0;
    interrupts_on();
    time_us += periods * BOARD_PERIOD_US;
    return periods;
}

uint32_t board_time_us(void)
{
    return time_us;
}

void board_mark_update(uint8_t level)
{
    mark(MARK_UPDATE, level);
}
