/* Division of 32 by 16 bits, which a processor without a divider should not do as 32 by 32.
 *
 * Source: the schoolbook's shift and subtract, in AVR assembler; C elsewhere, bit for bit the same.
 * Cost: AVR 150 to 200 cycles (gcc's 32 / 32: 618).
 *
 * What it does with bad input: a quotient that 16 bits do not hold, a division by zero too, gives 65535.
 */
#ifndef FACTORLAB_DIVIDE_Q_H
#define FACTORLAB_DIVIDE_Q_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* a / b, rounded down. */
static inline uint16_t divide_q(uint32_t a, uint16_t b)
{
    if ((uint16_t)(a >> 16) >= b) {
        return 0xFFFFU;
    }
#ifdef __AVR__
    {
        uint8_t rounds = 4; /* of four bits */

        /* the quotient moves in where the low half of the numerator moves out */
        __asm__("1:                 \n\t"
                ".rept 4            \n\t"
                "lsl  %A[a]         \n\t"
                "rol  %B[a]         \n\t"
                "rol  %C[a]         \n\t"
                "rol  %D[a]         \n\t"
                "brcs 2f            \n\t"
                "cp   %C[a], %A[b]  \n\t"
                "cpc  %D[a], %B[b]  \n\t"
                "brcs 3f            \n\t"
                "2:                 \n\t"
                "sub  %C[a], %A[b]  \n\t"
                "sbc  %D[a], %B[b]  \n\t"
                "inc  %A[a]         \n\t"
                "3:                 \n\t"
                ".endr              \n\t"
                "dec  %[rounds]     \n\t"
                "brne 1b            \n\t"
                : [a] "+&r"(a), [rounds] "+&r"(rounds)
                : [b] "r"(b));
        return (uint16_t)a;
    }
#else
    return (uint16_t)(a / b);
#endif
}

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_DIVIDE_Q_H */
