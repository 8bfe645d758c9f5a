#include "../core/trig_q.c"
