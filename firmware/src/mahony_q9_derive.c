#include "../core/mahony_q9_derive.c"
