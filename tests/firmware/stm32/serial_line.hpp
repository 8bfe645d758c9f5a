// USART2: a data register before a shift register, each way (RM0368 19.3).
#ifndef FACTORLAB_TEST_STM32_SERIAL_LINE_HPP
#define FACTORLAB_TEST_STM32_SERIAL_LINE_HPP

static bool shifting, holding;
static uint8_t held_byte;
static uint64_t shift_ends;

static uint64_t byte_clocks()
{
    return static_cast<uint64_t>(std::llround(10.0 * usart2.brr.value * hclk() / apb1()));
}

static void shift_out(uint8_t byte)
{
    const uint32_t when[2] = {ticks, static_cast<uint32_t>(now - last_tick)};
    std::fputc(byte, bytes);
    std::fwrite(when, sizeof when, 1, times);
    shifting = true;
    shift_ends = now + byte_clocks();
}

static void write_dr(Register *, uint32_t given)
{
    if ((usart2.sr.value & USART_SR_TXE) == 0 || (usart2.cr1.value & USART_CR1_TE) == 0) {
        violation("a byte into a serial line that has no room");
    }
    if (!shifting) {
        shift_out(static_cast<uint8_t>(given));
    } else {
        held_byte = static_cast<uint8_t>(given);
        holding = true;
        usart2.sr.value &= ~USART_SR_TXE;
    }
}

static uint32_t read_dr(Register *self)
{
    usart2.sr.value &= ~USART_SR_RXNE;
    return self->value;
}

static void arrive(uint8_t byte)
{
    usart2.dr.value = byte;
    usart2.sr.value |= (usart2.sr.value & USART_SR_RXNE) != 0 ? USART_SR_ORE : USART_SR_RXNE;
}

static void usart_step()
{
    if (!shifting || now < shift_ends) {
        return;
    }
    shifting = false;
    if (holding) {
        holding = false;
        usart2.sr.value |= USART_SR_TXE;
        shift_out(held_byte);
    }
}

#endif
