#include "../core/mahony_f32_settings.c"
