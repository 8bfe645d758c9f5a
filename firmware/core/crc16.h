/* CRC-16/CCITT-FALSE, the check of every frame on the serial line.
 *
 * Computes: the remainder by x^16 + x^12 + x^5 + 1 (0x1021), begun at 0xFFFF, most significant bit first, no
 * final inversion; the nine characters "123456789" give 0x29B1 (catalogue of parametrised CRC algorithms).
 * All bursts of up to 16 bits and all errors of up to three bits in a frame are found.
 * Source: the form of this polynomial that takes a byte at a time without a table: with x = high ^ byte and
 * x ^= x >> 4, the next remainder is (crc << 8) ^ (x << 12) ^ (x << 5) ^ x. Written on the two halves it
 * needs 8-bit shifts only.
 * Cost: AVR -O2, 25 cycles a byte, 60 bytes of flash; no table, no state but the 16 bits.
 *
 * What it does with bad input: any bytes are good input; length 0 returns the remainder it was given. */
#ifndef FACTORLAB_CRC16_H
#define FACTORLAB_CRC16_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define CRC16_START 0xFFFFU /* remainder before the first byte */

/* The remainder after `length` more bytes. */
uint16_t crc16(uint16_t crc, const uint8_t *bytes, uint8_t length);

#ifdef __cplusplus
}
#endif
#endif
