/* Square roots by a table of 48 chords, and on an AVR the product of 32 bits: see fixed_q.h. */
#include "fixed_q.h"

#include "flash.h"

/* 2^31 / sqrt(k 2^26) for k = 16 ... 64, lowered by 0.049 % so that no chord is above the curve */
const uint16_t IN_FLASH FOR_ASSEMBLER inverse_roots_q[49] = {
    65503, 63548, 61757, 60110, 58588, 57176, 55861, 54634, 53483, 52403, 51385, 50424, 49516,
    48655, 47837, 47059, 46318, 45611, 44935, 44288, 43669, 43075, 42504, 41956, 41428, 40919,
    40429, 39956, 39500, 39058, 38632, 38218, 37818, 37430, 37054, 36689, 36335, 35990, 35655,
    35330, 35013, 34704, 34404, 34111, 33826, 33547, 33276, 33010, 32751,
};

uint16_t inverse_sqrt_q(uint32_t x)
{
    const uint16_t *chord = &inverse_roots_q[(uint8_t)(x >> 26) - 16];
    uint16_t from = flash_u16(chord);
    uint16_t fall = (uint16_t)(from - flash_u16(chord + 1));
    uint8_t along = (uint8_t)(x >> 18);
    return (uint16_t)(from - (uint16_t)(((uint32_t)fall * along) >> 8) - 1U);
}

uint16_t sqrt_q(uint32_t x)
{
    uint8_t pairs = 0;
    if (x == 0) {
        return 0;
    }
    while (x < 0x40000000UL) {
        x <<= 2;
        pairs++;
    }
    return (uint16_t)(((x >> 16) * inverse_sqrt_q(x)) >> 15 >> pairs);
}

#ifdef __AVR__
/* Unsigned products of halves, then those of the sign bits taken off. */
int32_t mul32_q(int32_t a, int32_t b)
{
    int32_t product;
    uint32_t low; /* half of the product */
    uint8_t zero;
    __asm__("clr  %[z]         \n\t"
            "mul  %A[a], %A[b] \n\t"
            "movw %A[l], r0    \n\t"
            "mul  %B[a], %B[b] \n\t"
            "movw %C[l], r0    \n\t"
            "mul  %B[a], %A[b] \n\t"
            "add  %B[l], r0    \n\t"
            "adc  %C[l], r1    \n\t"
            "adc  %D[l], %[z]  \n\t"
            "mul  %A[a], %B[b] \n\t"
            "add  %B[l], r0    \n\t"
            "adc  %C[l], r1    \n\t"
            "adc  %D[l], %[z]  \n\t"
            "mul  %C[a], %C[b] \n\t"
            "movw %A[p], r0    \n\t"
            "mul  %D[a], %D[b] \n\t"
            "movw %C[p], r0    \n\t"
            "mul  %D[a], %C[b] \n\t"
            "add  %B[p], r0    \n\t"
            "adc  %C[p], r1    \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %C[a], %D[b] \n\t"
            "add  %B[p], r0    \n\t"
            "adc  %C[p], r1    \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %C[a], %A[b] \n\t"
            "add  %C[l], r0    \n\t"
            "adc  %D[l], r1    \n\t"
            "adc  %A[p], %[z]  \n\t"
            "adc  %B[p], %[z]  \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %A[a], %C[b] \n\t"
            "add  %C[l], r0    \n\t"
            "adc  %D[l], r1    \n\t"
            "adc  %A[p], %[z]  \n\t"
            "adc  %B[p], %[z]  \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %D[a], %A[b] \n\t"
            "add  %D[l], r0    \n\t"
            "adc  %A[p], r1    \n\t"
            "adc  %B[p], %[z]  \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %C[a], %B[b] \n\t"
            "add  %D[l], r0    \n\t"
            "adc  %A[p], r1    \n\t"
            "adc  %B[p], %[z]  \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %B[a], %C[b] \n\t"
            "add  %D[l], r0    \n\t"
            "adc  %A[p], r1    \n\t"
            "adc  %B[p], %[z]  \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %A[a], %D[b] \n\t"
            "add  %D[l], r0    \n\t"
            "adc  %A[p], r1    \n\t"
            "adc  %B[p], %[z]  \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %D[a], %B[b] \n\t"
            "add  %A[p], r0    \n\t"
            "adc  %B[p], r1    \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "mul  %B[a], %D[b] \n\t"
            "add  %A[p], r0    \n\t"
            "adc  %B[p], r1    \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "sbrs %D[a], 7     \n\t"
            "rjmp 1f           \n\t"
            "sub  %A[p], %A[b] \n\t"
            "sbc  %B[p], %B[b] \n\t"
            "sbc  %C[p], %C[b] \n\t"
            "sbc  %D[p], %D[b] \n\t"
            "1:                \n\t"
            "sbrs %D[b], 7     \n\t"
            "rjmp 2f           \n\t"
            "sub  %A[p], %A[a] \n\t"
            "sbc  %B[p], %B[a] \n\t"
            "sbc  %C[p], %C[a] \n\t"
            "sbc  %D[p], %D[a] \n\t"
            "2:                \n\t"
            "lsl  %D[l]        \n\t"
            "adc  %A[p], %[z]  \n\t"
            "adc  %B[p], %[z]  \n\t"
            "adc  %C[p], %[z]  \n\t"
            "adc  %D[p], %[z]  \n\t"
            "clr  r1           \n\t"
            : [p] "=&r"(product), [l] "=&r"(low), [z] "=&r"(zero)
            : [a] "r"(a), [b] "r"(b)
            : "r0");
    return product;
}
#endif
