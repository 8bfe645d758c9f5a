#include "stack.h"

#define PAINT 0xA5A5A5A5UL
#define MARGIN 16 /* words in use while it is painted */
#define WORDS (STACK_WATCHED / sizeof(uint32_t))

extern uint32_t stack_watched[WORDS]; /* of the linker script */

void stack_paint(void)
{
    const uint32_t *end = (const uint32_t *)__builtin_frame_address(0) - MARGIN;
    for (uint32_t *word = stack_watched; word < end; word++) {
        *word = PAINT;
    }
}

uint32_t stack_used(void)
{
    uint32_t untouched = 0;
    while (untouched < WORDS && stack_watched[untouched] == PAINT) {
        untouched++;
    }
    return STACK_WATCHED - untouched * (uint32_t)sizeof(uint32_t);
}
