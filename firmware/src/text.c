#include "../core/text.c"
