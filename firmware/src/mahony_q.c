#pragma GCC optimize("O2") /* Arduino asks for -Os, which costs this filter a third of its speed */
#include "../core/mahony_q.c"
