#include "../core/tilt_f32.c"
