#include "../core/error_state_report_f32.c"
