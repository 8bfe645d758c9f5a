#include "../core/mahony_q_update.c"
