#include "../core/complementary_q_derive.c"
