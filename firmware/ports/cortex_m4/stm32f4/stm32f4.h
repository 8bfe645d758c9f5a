/* The few registers used of an STM32F4, with their addresses: STMicroelectronics RM0368 (F401), section 2.3
 * and the register maps of 3.8 (flash), 6.3 (RCC), 8.4 (GPIO), 13.4 (TIM2), 18.6 (I2C), 19.6 (USART).
 * RM0383 (F411) and RM0090 (F405, F407) have the same ones at the same places.
 */
#ifndef FACTORLAB_STM32F4_H
#define FACTORLAB_STM32F4_H

#include <stdint.h>

struct rcc {
    volatile uint32_t cr;      /* 0x00 */
    volatile uint32_t pllcfgr; /* 0x04 */
    volatile uint32_t cfgr;    /* 0x08 */
    volatile uint32_t cir;     /* 0x0C */
    volatile uint32_t ahb1rstr, ahb2rstr, ahb3rstr, reserved_1c;
    volatile uint32_t apb1rstr, apb2rstr, reserved_28, reserved_2c; /* 0x20 */
    volatile uint32_t ahb1enr, ahb2enr, ahb3enr, reserved_3c;       /* 0x30 */
    volatile uint32_t apb1enr;                                      /* 0x40 */
};

#define RCC ((struct rcc *)0x40023800UL)
#define RCC_CR_HSEON (1UL << 16)
#define RCC_CR_HSERDY (1UL << 17)
#define RCC_CR_HSEBYP (1UL << 18)
#define RCC_CR_PLLON (1UL << 24)
#define RCC_CR_PLLRDY (1UL << 25)
#define RCC_PLLCFGR_N (6U)            /* bit 6: factor of the VCO, 50 to 432 */
#define RCC_PLLCFGR_P4 (1UL << 16)    /* the core has a fourth of the VCO */
#define RCC_PLLCFGR_HSE (1UL << 22)   /* source; else HSI */
#define RCC_PLLCFGR_Q (24U)           /* bit 24: divider for USB */
#define RCC_CFGR_PLL 2UL              /* clock switch */
#define RCC_CFGR_SWITCHED (3UL << 2)  /* clock switch status */
#define RCC_CFGR_APB1_HALF (4UL << 10)
#define RCC_AHB1_GPIOA (1UL << 0)
#define RCC_AHB1_GPIOB (1UL << 1)
#define RCC_APB1_TIM2 (1UL << 0)
#define RCC_APB1_USART2 (1UL << 17)
#define RCC_APB1_I2C1 (1UL << 21)

#define FLASH_ACR (*(volatile uint32_t *)0x40023C00UL)
#define FLASH_2_WAIT_STATES 2UL                       /* 60 to 90 MHz at 2.7 to 3.6 V */
#define FLASH_CACHES ((1UL << 8) | (1UL << 9) | (1UL << 10)) /* prefetch, instructions, data */

struct gpio {
    volatile uint32_t moder;   /* 0x00: two bits a pin: input, output, alternate, analog */
    volatile uint32_t otyper;  /* 0x04: 1 open drain */
    volatile uint32_t ospeedr; /* 0x08 */
    volatile uint32_t pupdr;   /* 0x0C: two bits a pin: none, up, down */
    volatile uint32_t idr;     /* 0x10 */
    volatile uint32_t odr;     /* 0x14 */
    volatile uint32_t bsrr;    /* 0x18: low half sets, high half clears */
    volatile uint32_t lckr;    /* 0x1C */
    volatile uint32_t afr[2];  /* 0x20: four bits a pin */
};

#define GPIOA ((struct gpio *)0x40020000UL)
#define GPIOB ((struct gpio *)0x40020400UL)
#define GPIO_OUTPUT 1UL
#define GPIO_ALTERNATE 2UL
#define GPIO_UP 1UL

struct tim {
    volatile uint32_t cr1;  /* 0x00 */
    volatile uint32_t cr2;  /* 0x04 */
    volatile uint32_t smcr; /* 0x08 */
    volatile uint32_t dier; /* 0x0C */
    volatile uint32_t sr;   /* 0x10 */
    volatile uint32_t egr;  /* 0x14 */
    volatile uint32_t ccmr[2], ccer;
    volatile uint32_t cnt; /* 0x24 */
    volatile uint32_t psc; /* 0x28: divider less one */
    volatile uint32_t arr; /* 0x2C */
};

#define TIM2 ((struct tim *)0x40000000UL)
#define TIM_CR1_CEN (1UL << 0)
#define TIM_CR1_URS (1UL << 2) /* only an overflow asks for an interrupt, not a restart */
#define TIM_CR1_OPM (1UL << 3) /* stops at the overflow */
#define TIM_DIER_UIE (1UL << 0)
#define TIM_EGR_UG (1UL << 0)

struct usart {
    volatile uint32_t sr;  /* 0x00 */
    volatile uint32_t dr;  /* 0x04 */
    volatile uint32_t brr; /* 0x08: clocks a bit */
    volatile uint32_t cr1; /* 0x0C */
};

#define USART2 ((struct usart *)0x40004400UL)
#define USART_SR_ORE (1UL << 3)
#define USART_SR_RXNE (1UL << 5)
#define USART_SR_TXE (1UL << 7)
#define USART_CR1_RE (1UL << 2)
#define USART_CR1_TE (1UL << 3)
#define USART_CR1_RXNEIE (1UL << 5)
#define USART_CR1_TXEIE (1UL << 7)
#define USART_CR1_UE (1UL << 13)

struct i2c {
    volatile uint32_t cr1, cr2; /* 0x00 */
    volatile uint32_t oar1, oar2;
    volatile uint32_t dr;       /* 0x10 */
    volatile uint32_t sr1, sr2; /* 0x14 */
    volatile uint32_t ccr;      /* 0x1C */
    volatile uint32_t trise;    /* 0x20 */
};

#define I2C1 ((struct i2c *)0x40005400UL)
#define I2C_CR1_PE (1UL << 0)
#define I2C_CR1_START (1UL << 8)
#define I2C_CR1_STOP (1UL << 9)
#define I2C_CR1_ACK (1UL << 10)
#define I2C_CR1_POS (1UL << 11) /* ACK counts for the byte after the one being received */
#define I2C_CR1_SWRST (1UL << 15)
#define I2C_CR2_ITERREN (1UL << 8)
#define I2C_CR2_ITEVTEN (1UL << 9)
#define I2C_CR2_ITBUFEN (1UL << 10)
#define I2C_SR1_SB (1UL << 0)
#define I2C_SR1_ADDR (1UL << 1)
#define I2C_SR1_BTF (1UL << 2)
#define I2C_SR1_RXNE (1UL << 6)
#define I2C_SR1_TXE (1UL << 7)
#define I2C_SR1_BERR (1UL << 8)
#define I2C_SR1_ARLO (1UL << 9)
#define I2C_SR1_AF (1UL << 10)
#define I2C_SR1_OVR (1UL << 11)
#define I2C_CCR_FAST (1UL << 15)

/* Places in the vector table, from the first interrupt on: RM0368 table 38. */
#define TIM2_IRQ 28
#define I2C1_EV_IRQ 31
#define I2C1_ER_IRQ 32
#define USART2_IRQ 38

#endif /* FACTORLAB_STM32F4_H */
