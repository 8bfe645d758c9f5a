#include "../core/error_state_heading_f32.c"
