#include "../core/turning_q.c"
