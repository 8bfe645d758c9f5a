/* An MPU-6050 at +-2000 deg/s and +-8 g as its data sheet has it; better: `factorlab calibrate ... --c-header`. */
#include "../app/calibration_default.h"
