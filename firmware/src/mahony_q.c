#pragma GCC optimize("O3") /* Arduino asks for -Os, which costs this filter a third of its speed */
#include "../core/mahony_q.c"
