#include "../core/mahony_q_derive.c"
