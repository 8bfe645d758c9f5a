#include "crc16.h"

uint16_t crc16(uint16_t crc, const uint8_t *bytes, uint8_t length)
{
    uint8_t high = (uint8_t)(crc >> 8);
    uint8_t low = (uint8_t)crc;
    for (; length > 0; length--) {
        uint8_t x = (uint8_t)(high ^ *bytes++);
        x = (uint8_t)(x ^ (x >> 4));
        high = (uint8_t)(low ^ (uint8_t)(x << 4) ^ (x >> 3));
        low = (uint8_t)(x ^ (uint8_t)(x << 5));
    }
    return (uint16_t)(((uint16_t)high << 8) | low);
}
