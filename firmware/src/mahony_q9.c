#include "../core/mahony_q9.c"
