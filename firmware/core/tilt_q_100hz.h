/* What tilt_q_derive makes of tilt_q_defaults at 100 samples a second: for images without floating point.
 *
 * A test holds these numbers against the functions.  Other settings: let a program on the host print its own.
 */
#ifndef FACTORLAB_TILT_Q_100HZ_H
#define FACTORLAB_TILT_Q_100HZ_H

#include "tilt_q.h"

static const struct tilt_q_derived tilt_q_100hz = {
    {
        /* by gravity, R = (0.1 rad)^2 */
        {
            4295UL,       /* angle: (0.002 rad/s/sqrt(Hz))^2 a period, Q30 */
            144115UL,     /* bias: (0.0001 rad/s^2/sqrt(Hz))^2 a period, Q57 */
            54975584UL,   /* unknown bias: (0.05 rad/s)^2, Q41 */
            4290619904UL, /* unknown angle: pi^2 / (pi^2 + R), Q32 */
            4294967295UL, /* no gate */
            1L,           /* both: half of what bias gets, Q41 */
            3,            /* finer: Q41 for Q38 */
        },
        /* by the field, R = (0.3 rad)^2 */
        {
            477UL,
            64051UL,
            24433594UL,
            4256155648UL,
            4294967295UL,
            0L,
            5,
        },
    },
    874963520L,  /* 1 rad/s for a period, 2^-29 turns Q22, Q32 */
    41177484L,   /* and back, Q32 */
    1749927040L, /* bias limit: 1 rad/s, 2^-40 turns a period */
    100,         /* pause: 1 s, periods */
};

#endif /* FACTORLAB_TILT_Q_100HZ_H */
