#include "../core/angles_f32.c"
