/* An MPU-6050 at +-2000 deg/s and +-8 g as in its data sheet.  Better: `factorlab calibrate ... --c-header`. */
#include "../app/calibration_default.h"
