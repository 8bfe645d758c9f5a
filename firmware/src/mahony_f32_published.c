#include "../core/mahony_f32_published.c"
