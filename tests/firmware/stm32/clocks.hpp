// RCC: what the core and APB1 run at (RM0368 6.2, 6.3).
#ifndef FACTORLAB_TEST_STM32_CLOCKS_HPP
#define FACTORLAB_TEST_STM32_CLOCKS_HPP

static const double HSE = 8e6, HSI = 16e6;
static bool no_hse, no_pll;

static double pll_hz()
{
    const uint32_t given = rcc.pllcfgr.value;
    const double source = (given & RCC_PLLCFGR_HSE) != 0 ? HSE : HSI;
    const double input = source / (given & 63U), vco = input * ((given >> 6) & 511U);
    if (input < 0.95e6 || input > 2.1e6 || vco < 192e6 || vco > 432e6) {
        violation("the PLL is out of its range");
    }
    return vco / (2.0 * (((given >> 16) & 3U) + 1.0));
}

static double hclk() { return (rcc.cfgr.value & 3U) == RCC_CFGR_PLL ? pll_hz() : HSI; }

static double apb1()
{
    return hclk() / ((rcc.cfgr.value & (7U << 10)) == RCC_CFGR_APB1_HALF ? 2.0 : 1.0);
}

static void write_cr(Register *self, uint32_t given)
{
    self->value = given & ~(RCC_CR_HSERDY | RCC_CR_PLLRDY);
    self->value |= (given & RCC_CR_HSEON) != 0 && !no_hse ? RCC_CR_HSERDY : 0;
    self->value |= (given & RCC_CR_PLLON) != 0 && !no_pll ? RCC_CR_PLLRDY : 0;
}

static void write_cfgr(Register *self, uint32_t given)
{
    const bool ready = (flash_acr.value & 7U) >= 2 && (rcc.cr.value & RCC_CR_PLLRDY) != 0;
    if ((given & 3U) == RCC_CFGR_PLL && !ready) {
        violation("a fast clock before the flash or the PLL is ready for it");
    }
    self->value = (given & ~RCC_CFGR_SWITCHED) | ((given & 3U) << 2);
}

#endif
