/* Whom an interrupt calls. */
#include "../startup.h"
#include "port.h"

__attribute__((section(".vectors"), used)) static const handler vectors[16 + USART2_IRQ + 1] = {
    (handler)stack_top,
    reset_handler,
    default_handler, /* NMI */
    default_handler, /* hard fault */
    default_handler, /* memory, bus, usage */
    default_handler,
    default_handler,
    [11] = default_handler, /* SVC */
    [14] = default_handler, /* PendSV */
    [15] = systick_handler,
    [16 + TIM2_IRQ] = tim2_handler,
    [16 + I2C1_EV_IRQ] = i2c1_event_handler,
    [16 + I2C1_ER_IRQ] = i2c1_error_handler,
    [16 + USART2_IRQ] = usart2_handler,
};
