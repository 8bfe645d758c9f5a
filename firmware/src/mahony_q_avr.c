#include "../core/mahony_q_avr.c"
