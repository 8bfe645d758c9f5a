/* What complementary_q_derive makes of complementary_q_defaults at 100 samples a second: for images without floating
 * point.
 *
 * A test holds these numbers against the functions.  Other settings: let a program on the host print its own.
 */
#ifndef FACTORLAB_COMPLEMENTARY_Q_100HZ_H
#define FACTORLAB_COMPLEMENTARY_Q_100HZ_H

#include "complementary_q.h"

static const struct complementary_q_derived complementary_q_100hz = {
    8581350UL,  /* share of the tilt: 1 - exp(-0.01 / 5), Q32 */
    4292820UL,  /* share of the heading: 1 - exp(-0.01 / 10), Q32 */
    687194752L, /* half a period: 0.005 s, Q37 */
    100,        /* pause: 1 s, periods */
};

#endif /* FACTORLAB_COMPLEMENTARY_Q_100HZ_H */
