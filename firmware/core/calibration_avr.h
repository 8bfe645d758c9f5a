/* The sums of a calibration in AVR assembler: bit for bit the C of calibration_q.c, which includes this.
 *
 * A sum has 56 bits: `below` is byte 0, `sum` bytes 1 to 4, which are the result, `above` bytes 5 and 6.  Products
 * are unsigned first; then comes off what the signs take, and their own sign is carried up.
 * Cost: 240 cycles, 110 for each entry of the matrix; 25 where it is zero.
 */
#ifndef FACTORLAB_CALIBRATION_AVR_H
#define FACTORLAB_CALIBRATION_AVR_H

#include <stdint.h>

/* Alone, because it needs every register there is. */
static __attribute__((noinline)) void calibrated(const struct affine_q *affine, const int16_t raw[3],
                                                 int32_t fine[3])
{
    const int32_t *row = affine->matrix[0];
    const int32_t *shift = affine->shift;
    uint8_t below;
    uint32_t sum;
    uint16_t above;
    uint8_t columns;
    uint8_t rows = 3;
    uint32_t a;
    uint16_t b;
    uint32_t low; /* of a product */
    uint16_t high;
    uint8_t zero;

    __asm__ volatile(
        "1:                   \n\t" /* a row */
        "ldi  %[e], 128       \n\t" /* half of a unit of Q24 */
        "clr  %A[s]           \n\t"
        "clr  %B[s]           \n\t"
        "movw %C[s], %A[s]    \n\t"
        "movw %A[u], %A[s]    \n\t"
        "ldi  %[n], 3         \n\t"
        "2:                   \n\t" /* a column */
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
        "brne 3f              \n\t"
        "rjmp 6f              \n\t"
        "3:                   \n\t"
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
        "rjmp 4f              \n\t"
        "sub  %A[h], %A[b]    \n\t"
        "sbc  %B[h], %B[b]    \n\t"
        "4:                   \n\t"
        "sbrs %B[b], 7        \n\t"
        "rjmp 5f              \n\t"
        "sub  %C[l], %A[a]    \n\t"
        "sbc  %D[l], %B[a]    \n\t"
        "sbc  %A[h], %C[a]    \n\t"
        "sbc  %B[h], %D[a]    \n\t"
        "5:                   \n\t"
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
        "6:                   \n\t"
        "dec  %[n]            \n\t"
        "breq 7f              \n\t"
        "rjmp 2b              \n\t"
        "7:                   \n\t" /* the shift comes off */
        "movw %A[l], %A[row]  \n\t"
        "movw %A[row], %A[t]  \n\t"
        "ld   %A[a], %a[row]+ \n\t"
        "ld   %B[a], %a[row]+ \n\t"
        "ld   %C[a], %a[row]+ \n\t"
        "ld   %D[a], %a[row]+ \n\t"
        "movw %A[t], %A[row]  \n\t"
        "movw %A[row], %A[l]  \n\t"
        "mov  %[z], %D[a]     \n\t"
        "lsl  %[z]            \n\t"
        "sbc  %[z], %[z]      \n\t"
        "sub  %A[s], %A[a]    \n\t"
        "sbc  %B[s], %B[a]    \n\t"
        "sbc  %C[s], %C[a]    \n\t"
        "sbc  %D[s], %D[a]    \n\t"
        "sbc  %A[u], %[z]     \n\t"
        "sbc  %B[u], %[z]     \n\t"
        "mov  %[z], %D[s]     \n\t" /* what does not fit saturates */
        "lsl  %[z]            \n\t"
        "sbc  %[z], %[z]      \n\t"
        "cp   %[z], %A[u]     \n\t"
        "cpc  %[z], %B[u]     \n\t"
        "breq 9f              \n\t"
        "ldi  %[n], 0x7F      \n\t"
        "ldi  %[e], 0xFF      \n\t"
        "sbrs %B[u], 7        \n\t"
        "rjmp 8f              \n\t"
        "ldi  %[n], 0x80      \n\t"
        "clr  %[e]            \n\t"
        "8:                   \n\t"
        "mov  %A[s], %[e]     \n\t"
        "mov  %B[s], %[e]     \n\t"
        "mov  %C[s], %[e]     \n\t"
        "mov  %D[s], %[n]     \n\t"
        "9:                   \n\t"
        "st   %a[fine]+, %A[s] \n\t"
        "st   %a[fine]+, %B[s] \n\t"
        "st   %a[fine]+, %C[s] \n\t"
        "st   %a[fine]+, %D[s] \n\t"
        "sbiw %A[raw], 6      \n\t"
        "dec  %[m]            \n\t"
        "breq 10f             \n\t"
        "rjmp 1b              \n\t"
        "10:                  \n\t"
        "clr  r1              \n\t"
        : [s] "=&r"(sum), [u] "=&r"(above), [e] "=&d"(below), [n] "=&d"(columns), [m] "+r"(rows), [a] "=&r"(a),
          [b] "=&r"(b), [l] "=&r"(low), [h] "=&r"(high), [z] "=&r"(zero), [row] "+z"(row), [t] "+r"(shift),
          [raw] "+x"(raw), [fine] "+y"(fine)
        :
        : "r0", "memory");
}

#endif /* FACTORLAB_CALIBRATION_AVR_H */
