/* The attitude filters of factorlab for Arduino: one header for a sketch.
 *
 * Sources stand in ../core, where each header says what it computes and what it does with bad input; the
 * files beside this one only bring them to the Arduino builder.
 */
#ifndef FACTORLAB_H
#define FACTORLAB_H

#include "../core/calibration_f32.h"
#include "../core/calibration_q.h"
#include "../core/complementary_q.h"
#include "../core/complementary_q_100hz.h"
#include "../core/frame.h"
#include "../core/imu.h"
#include "../core/mahony_f32.h"
#include "../core/mahony_q.h"
#include "../core/mahony_q_100hz.h"
#include "../core/text.h"
#include "../core/tilt_q.h"
#include "../core/tilt_q_100hz.h"
#include "../core/trig_q.h"

#endif /* FACTORLAB_H */
