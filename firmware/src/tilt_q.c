#include "../core/tilt_q.c"
