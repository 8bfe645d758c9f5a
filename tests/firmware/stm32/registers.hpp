// Registers that notice being read and written, in the place of an STM32F4's: included before each file of
// the board, which is then compiled as C++ and runs on a model of the peripherals.
#ifndef FACTORLAB_TEST_STM32_REGISTERS_HPP
#define FACTORLAB_TEST_STM32_REGISTERS_HPP

#include <stdint.h>

struct Register {
    uint32_t value = 0;
    uint32_t (*reading)(Register *) = nullptr;
    void (*writing)(Register *, uint32_t) = nullptr;
    operator uint32_t() { return reading != nullptr ? reading(this) : value; }
    uint32_t operator=(uint32_t given)
    {
        if (writing != nullptr) {
            writing(this, given);
        } else {
            value = given;
        }
        return given;
    }
    uint32_t operator|=(uint32_t bits) { return *this = static_cast<uint32_t>(*this) | bits; }
    uint32_t operator&=(uint32_t bits) { return *this = static_cast<uint32_t>(*this) & bits; }
};

// cortex_m4.h, of which a computer has nothing
#define FACTORLAB_CORTEX_M4_H
struct systick {
    Register ctrl, load, value;
};
#define SYSTICK_RUN 7U
void interrupt_enable(uint32_t number);
void interrupt_pend(uint32_t number);
void interrupts_off();
void interrupts_on();
void wait_for_interrupt();

#define volatile
#define uint32_t Register
#include "stm32f4.h"
#undef uint32_t
#undef volatile

extern struct systick systick;
extern struct rcc rcc;
extern struct gpio gpioa, gpiob;
extern struct tim tim2;
extern struct usart usart2;
extern struct i2c i2c1;
extern Register flash_acr;

#define SYSTICK (&systick)
#undef RCC
#undef GPIOA
#undef GPIOB
#undef TIM2
#undef USART2
#undef I2C1
#undef FLASH_ACR
#define RCC (&rcc)
#define GPIOA (&gpioa)
#define GPIOB (&gpiob)
#define TIM2 (&tim2)
#define USART2 (&usart2)
#define I2C1 (&i2c1)
#define FLASH_ACR flash_acr

#endif
