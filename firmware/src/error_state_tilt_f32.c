#include "../core/error_state_tilt_f32.c"
