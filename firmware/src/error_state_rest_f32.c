#include "../core/error_state_rest_f32.c"
