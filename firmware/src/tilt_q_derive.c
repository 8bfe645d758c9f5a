#include "../core/tilt_q_derive.c"
