#include "../core/fixed_q.c"
