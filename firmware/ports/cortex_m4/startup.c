#include "startup.h"

#include <stdint.h>
#include <string.h>

#define CPACR (*(volatile uint32_t *)0xE000ED88UL) /* coprocessor access: ARMv7-M manual, B3.2.20 */
#define CP10_CP11_FULL (0xFUL << 20)

extern unsigned char data_start[], data_load[], bss_start[]; /* of the linker script */
extern unsigned char data_size[], bss_size[];                /* their addresses are bytes */
int main(void);

/* The FPU comes first: the compiler may keep integers in its registers as soon as C runs. */
void reset_handler(void)
{
    CPACR |= CP10_CP11_FULL;
    __asm volatile("dsb\n\tisb" ::: "memory");
    memcpy(data_start, data_load, (size_t)data_size);
    memset(bss_start, 0, (size_t)bss_size);
    (void)main();
    default_handler();
}

__attribute__((weak)) void default_handler(void)
{
    for (;;) {
    }
}
