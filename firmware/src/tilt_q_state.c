#include "../core/tilt_q_state.c"
