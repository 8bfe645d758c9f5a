#include "../core/calibration_q.c"
