#include "../core/error_state_turning_f32.c"
