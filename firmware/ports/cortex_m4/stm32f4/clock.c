/* The clock tree:
 *
 *     HSE (HSE_HZ) or HSI 16 MHz --/M--> 1 MHz --x336--> 336 MHz --/4--> core, AHB 84 MHz
 *                                                             --/7--> 48 MHz (USB, not used)
 *     AHB --/2--> APB1 42 MHz (USART2, I2C1); its timers count 84 MHz
 *
 * Source: RM0368 6.2 (84 MHz is the most of an F401, and within scale 2 of the regulator, which holds after
 * reset).
 * What it does with bad input: without a sign of HSE for some 20 ms it goes on with HSI, which is 1 % off at
 * 25 C; without one of the PLL it stays at 16 MHz, everything then at 16/84 of its speed.
 */
#include "port.h"

#ifndef HSE_HZ
#define HSE_HZ 8000000UL /* Nucleo-64: from the ST-LINK; "black pill": 25 MHz crystal */
#endif
#ifndef HSE_BYPASS
#define HSE_BYPASS 1 /* 1: a clock comes in; 0: a crystal hangs there */
#endif
#if HSE_HZ % 1000000UL != 0 || HSE_HZ < 4000000UL || HSE_HZ > 26000000UL
#error "HSE_HZ must be whole megahertz, 4 to 26"
#endif

#define HSI_MHZ 16UL
#define PATIENCE 100000UL /* turns of a loop of a few clocks */

static uint8_t is_ready(uint32_t flag)
{
    for (uint32_t k = 0; k < PATIENCE; k++) {
        if ((RCC->cr & flag) != 0U) {
            return 1;
        }
    }
    return 0;
}

static void switch_to_pll(void)
{
    FLASH_ACR = FLASH_2_WAIT_STATES | FLASH_CACHES;
    RCC->cfgr = RCC_CFGR_APB1_HALF | RCC_CFGR_PLL;
    for (uint32_t k = 0; k < PATIENCE && (RCC->cfgr & RCC_CFGR_SWITCHED) != RCC_CFGR_PLL << 2; k++) {
    }
}

void clock_start(void)
{
    uint32_t megahertz = HSI_MHZ, source = 0;
    RCC->cr |= HSE_BYPASS ? RCC_CR_HSEBYP : 0UL;
    RCC->cr |= RCC_CR_HSEON;
    if (is_ready(RCC_CR_HSERDY) != 0U) {
        megahertz = HSE_HZ / 1000000UL;
        source = RCC_PLLCFGR_HSE;
    }
    RCC->pllcfgr = megahertz | (336UL << RCC_PLLCFGR_N) | RCC_PLLCFGR_P4 | source | (7UL << RCC_PLLCFGR_Q);
    RCC->cr |= RCC_CR_PLLON;
    if (is_ready(RCC_CR_PLLRDY) != 0U) {
        switch_to_pll();
    }
}
