/* The sums of a calibration in AVR assembler: bit for bit the C of calibration_q.c, which includes this.
 *
 * A sum has 56 bits: `below` is byte 0, `sum` bytes 1 to 4, which are the result, `above` bytes 5 and 6.  Products
 * are unsigned first; then comes off what the signs take, and their own sign is carried up.
 * Cost: 75 cycles a product; 20 where the matrix has a zero.
 */
#ifndef FACTORLAB_CALIBRATION_AVR_H
#define FACTORLAB_CALIBRATION_AVR_H

#include <stdint.h>

/* Alone, because it needs nearly every register. */
static __attribute__((noinline)) int32_t calibrated_axis(const int32_t *row, const int16_t *counts, uint32_t sum)
{
    uint16_t above;
    uint8_t below = 128; /* half of a unit of Q24 */
    uint8_t columns = 3;
    uint32_t a;
    uint16_t b;
    uint32_t low; /* of a product */
    uint16_t high;
    uint8_t zero;

    __asm__("mov  %[z], %D[s]     \n\t"
            "lsl  %[z]            \n\t"
            "sbc  %[z], %[z]      \n\t"
            "movw %A[l], %A[s]    \n\t"
            "movw %C[l], %C[s]    \n\t"
            "clr  %A[s]           \n\t"
            "clr  %B[s]           \n\t"
            "clr  %C[s]           \n\t"
            "clr  %D[s]           \n\t"
            "clr  %A[u]           \n\t"
            "clr  %B[u]           \n\t"
            "sub  %A[s], %A[l]    \n\t"
            "sbc  %B[s], %B[l]    \n\t"
            "sbc  %C[s], %C[l]    \n\t"
            "sbc  %D[s], %D[l]    \n\t"
            "sbc  %A[u], %[z]     \n\t"
            "sbc  %B[u], %[z]     \n\t"
            "1:                   \n\t"
            "ld   %A[a], %a[row]+ \n\t"
            "ld   %B[a], %a[row]+ \n\t"
            "ld   %C[a], %a[row]+ \n\t"
            "ld   %D[a], %a[row]+ \n\t"
            "ld   %A[b], %a[raw]+ \n\t"
            "ld   %B[b], %a[raw]+ \n\t"
            "mov  %[z], %A[a]     \n\t"
            "or   %[z], %B[a]     \n\t"
            "or   %[z], %C[a]     \n\t"
            "or   %[z], %D[a]     \n\t"
            "brne 2f              \n\t"
            "rjmp 5f              \n\t"
            "2:                   \n\t"
            "clr  %[z]            \n\t"
            "mul  %A[a], %A[b]    \n\t"
            "movw %A[l], r0       \n\t"
            "mul  %C[a], %A[b]    \n\t"
            "movw %C[l], r0       \n\t"
            "mul  %D[a], %B[b]    \n\t"
            "movw %A[h], r0       \n\t"
            "mul  %B[a], %A[b]    \n\t"
            "add  %B[l], r0       \n\t"
            "adc  %C[l], r1       \n\t"
            "adc  %D[l], %[z]     \n\t"
            "adc  %A[h], %[z]     \n\t"
            "adc  %B[h], %[z]     \n\t"
            "mul  %D[a], %A[b]    \n\t"
            "add  %D[l], r0       \n\t"
            "adc  %A[h], r1       \n\t"
            "adc  %B[h], %[z]     \n\t"
            "mul  %A[a], %B[b]    \n\t"
            "add  %B[l], r0       \n\t"
            "adc  %C[l], r1       \n\t"
            "adc  %D[l], %[z]     \n\t"
            "adc  %A[h], %[z]     \n\t"
            "adc  %B[h], %[z]     \n\t"
            "mul  %B[a], %B[b]    \n\t"
            "add  %C[l], r0       \n\t"
            "adc  %D[l], r1       \n\t"
            "adc  %A[h], %[z]     \n\t"
            "adc  %B[h], %[z]     \n\t"
            "mul  %C[a], %B[b]    \n\t"
            "add  %D[l], r0       \n\t"
            "adc  %A[h], r1       \n\t"
            "adc  %B[h], %[z]     \n\t"
            "sbrs %D[a], 7        \n\t"
            "rjmp 3f              \n\t"
            "sub  %A[h], %A[b]    \n\t"
            "sbc  %B[h], %B[b]    \n\t"
            "3:                   \n\t"
            "sbrs %B[b], 7        \n\t"
            "rjmp 4f              \n\t"
            "sub  %C[l], %A[a]    \n\t"
            "sbc  %D[l], %B[a]    \n\t"
            "sbc  %A[h], %C[a]    \n\t"
            "sbc  %B[h], %D[a]    \n\t"
            "4:                   \n\t"
            "mov  %[z], %B[h]     \n\t"
            "lsl  %[z]            \n\t"
            "sbc  %[z], %[z]      \n\t"
            "add  %[e], %A[l]     \n\t"
            "adc  %A[s], %B[l]    \n\t"
            "adc  %B[s], %C[l]    \n\t"
            "adc  %C[s], %D[l]    \n\t"
            "adc  %D[s], %A[h]    \n\t"
            "adc  %A[u], %B[h]    \n\t"
            "adc  %B[u], %[z]     \n\t"
            "5:                   \n\t"
            "dec  %[n]            \n\t"
            "breq 6f              \n\t"
            "rjmp 1b              \n\t"
            "6:                   \n\t"
            "clr  r1              \n\t"
            : [s] "+r"(sum), [u] "=&r"(above), [e] "+r"(below), [n] "+r"(columns), [row] "+z"(row),
              [raw] "+x"(counts), [a] "=&r"(a), [b] "=&r"(b), [l] "=&r"(low), [h] "=&r"(high),
              [z] "=&r"(zero)
            :
            : "r0", "memory");
    if (above == ((sum & 0x80000000UL) != 0 ? 0xFFFFU : 0U)) {
        return (int32_t)sum;
    }
    return (above & 0x8000U) != 0 ? INT32_MIN : INT32_MAX;
}

static void calibrated(const struct affine_q *affine, const int16_t raw[3], int32_t fine[3])
{
    for (uint8_t i = 0; i < 3; i++) {
        fine[i] = calibrated_axis(affine->matrix[i], raw, (uint32_t)affine->shift[i]);
    }
}

#endif /* FACTORLAB_CALIBRATION_AVR_H */
