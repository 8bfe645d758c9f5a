#include "../core/error_state_gather_f32.c"
