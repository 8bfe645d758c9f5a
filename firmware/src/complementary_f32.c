#include "../core/complementary_f32.c"
