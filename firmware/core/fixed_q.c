/* Square roots: a table of 48 chords, see fixed_q.h. */
#include "fixed_q.h"

#include "flash.h"

/* 2^31 / sqrt(k 2^26) for k = 16 ... 64, lowered by 0.049 % so that no chord is above the curve */
const uint16_t IN_FLASH inverse_roots_q[49] = {
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
