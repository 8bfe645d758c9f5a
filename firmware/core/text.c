#include "text.h"

#define POWERS 10U

static const uint32_t power_of_ten[POWERS] = {1000000000UL, 100000000UL, 10000000UL, 1000000UL, 100000UL,
                                              10000UL,      1000UL,      100UL,      10UL,      1UL};

/* Digits for the powers first ... last - 1, without leading zeros before the power `must`. */
static uint8_t *put_digits(uint8_t *to, uint32_t value, uint8_t first, uint8_t must, uint8_t last)
{
    uint8_t started = 0;
    for (uint8_t k = first; k < last; k++) {
        uint8_t digit = '0';
        while (value >= power_of_ten[k]) {
            value -= power_of_ten[k];
            digit++;
        }
        if (started != 0 || digit != '0' || k >= must) {
            *to++ = digit;
            started = 1;
        }
    }
    return to;
}

static uint8_t *put_degrees(uint8_t *to, int16_t angle)
{
    uint16_t size = angle < 0 ? (uint16_t)(0U - (uint16_t)angle) : (uint16_t)angle;
    uint16_t hundredths = (uint16_t)(((uint32_t)size * 1125UL + 1024UL) >> 11);
    if (angle < 0 && hundredths != 0) {
        *to++ = '-';
    }
    to = put_digits(to, hundredths, 5, 7, POWERS);
    to[0] = to[-1];
    to[-1] = to[-2];
    to[-2] = '.';
    return to + 1;
}

static uint8_t hexadecimal(uint8_t digit)
{
    return (uint8_t)(digit < 10U ? digit + '0' : digit + 'A' - 10);
}

/* The checksum of what stands between the first character and `to`, and the end of the line. */
static uint8_t *put_end(const uint8_t *out, uint8_t *to)
{
    uint8_t sum = 0;
    for (const uint8_t *at = out + 1; at < to; at++) {
        sum = (uint8_t)(sum ^ *at);
    }
    *to++ = '*';
    *to++ = hexadecimal((uint8_t)(sum >> 4));
    *to++ = hexadecimal((uint8_t)(sum & 15U));
    *to++ = '\r';
    *to++ = '\n';
    return to;
}

uint8_t text_attitude(uint8_t *out, uint16_t sequence, uint32_t t_us, const int16_t roll_pitch_yaw[3])
{
    static const uint8_t name[] = {'$', 'A', 'T', 'T', ','};
    uint8_t *to = out;
    for (uint8_t k = 0; k < sizeof name; k++) {
        *to++ = name[k];
    }
    to = put_digits(to, sequence, 5, 9, POWERS);
    *to++ = ',';
    to = put_digits(to, t_us, 0, 6, 7); /* all but the last three digits: milliseconds */
    for (uint8_t k = 0; k < 3; k++) {
        *to++ = ',';
        to = put_degrees(to, roll_pitch_yaw[k]);
    }
    return (uint8_t)(put_end(out, to) - out);
}
