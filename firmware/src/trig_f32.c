#include "../core/trig_f32.c"
