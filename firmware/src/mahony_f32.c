#include "../core/mahony_f32.c"
