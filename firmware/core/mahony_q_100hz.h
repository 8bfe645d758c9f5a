/* What mahony_q_derive makes of mahony_q_defaults at 100 samples a second: for images without floating point.
 *
 * A test holds these numbers against the functions.  Other settings: let a program on the host print its own.
 */
#ifndef FACTORLAB_MAHONY_Q_100HZ_H
#define FACTORLAB_MAHONY_Q_100HZ_H

#include "mahony_q.h"

static const struct mahony_q_derived mahony_q_100hz = {
    10737418UL, /* half a period: 0.005 s, Q31 */
    429496736L, /* bias limit: 0.1 rad/s, Q32 */
    2294L,      /* gyro at rest: 0.035 rad/s, Q16 */
    128L,       /* accelerometer at rest: 0.5 m/s^2, Q8 */
    {
        1285, /* low-passes: 1 / 51, Q16 */
        649,  /* bias at rest: 1 / 101, Q16 */
        8384, /* lasting error: 1 / 2001, Q24 */
        336,  /* integral gain: 0.0005 1/s^2 times a period, Q26 */
        1,
    },
    655,   /* gain: 0.5 1/s times half a period, Q18 */
    10626, /* boost: 9.5 1/s times half a period, a period of 300, Q26 */
    819,   /* error limit: 0.05, Q14 */
    50,    /* low-passes: 0.5 s, periods */
    100,   /* bias at rest: 1 s, periods */
    300,   /* quick start: 3 s, periods */
    150,   /* rest: 1.5 s, periods */
    100,   /* pause: 1 s, periods */
    64,    /* gyro limit, rad/s */
};

#endif /* FACTORLAB_MAHONY_Q_100HZ_H */
