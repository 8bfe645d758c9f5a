#include "../core/error_state_f32.c"
