#include "../core/mahony_q_start.c"
