#include "../core/error_state_reading_f32.c"
