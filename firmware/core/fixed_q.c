/* Square roots: a table of 48 chords, see fixed_q.h. */
#include "fixed_q.h"

#include "flash.h"

/* 2^31 / sqrt(k 2^26) for k = 16 ... 64, lowered by 0.046 % so that no chord is above the curve */
static const uint16_t IN_FLASH inverse_roots[49] = {
    65505, 63550, 61759, 60112, 58590, 57178, 55863, 54635, 53485, 52404, 51387, 50426, 49517,
    48656, 47838, 47060, 46319, 45612, 44936, 44290, 43670, 43076, 42505, 41957, 41429, 40921,
    40431, 39958, 39501, 39060, 38633, 38220, 37819, 37431, 37055, 36690, 36336, 35991, 35656,
    35331, 35014, 34705, 34405, 34112, 33827, 33548, 33277, 33011, 32752,
};

uint16_t inverse_sqrt_q(uint32_t x)
{
    const uint16_t *chord = &inverse_roots[(uint8_t)(x >> 26) - 16];
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
