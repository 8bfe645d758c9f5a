#include "../core/crc16.c"
