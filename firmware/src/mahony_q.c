#include "../core/mahony_q.c"
