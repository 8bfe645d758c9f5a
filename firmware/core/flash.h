/* Tables that stay in flash on a machine whose flash is not in the address space of data. */
#ifndef FACTORLAB_FLASH_H
#define FACTORLAB_FLASH_H

#include <stdint.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#define IN_FLASH PROGMEM
#define FOR_ASSEMBLER __attribute__((used, externally_visible)) /* a name that link-time optimisation keeps */
static inline uint16_t flash_u16(const uint16_t *place) { return pgm_read_word(place); }
#else
#define IN_FLASH
#define FOR_ASSEMBLER
static inline uint16_t flash_u16(const uint16_t *place) { return *place; }
#endif

#endif /* FACTORLAB_FLASH_H */
