#include "../core/complementary_q.c"
