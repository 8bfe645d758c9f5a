/* Mahony's attitude filter with magnetometer, in fixed point: what it adds to mahony_q.h, which does the
 * rest.
 *
 * Computes, with (east, north) the field's horizontal direction by the estimate, of unit length:
 *     first field: the heading is turned until the field points north
 *     then       e = east (its sign where the field points south), unless the field is out of heading_gate
 *                k_H e v is added to the turn of mahony_q.h, k_I e v to what its bias takes, v the vertical
 * As sequential.attitude.Mahony with its defaults; `tilt_by_field` is not here.
 *
 * Source: see mahony_q.h.
 * Cost: 5 bytes of state more.  An AVR takes C here, not assembler: some 15 000 cycles in all.
 *
 * What it does with bad input: as mahony_q.h, and
 * - field all zero (none came), or within 0.06 deg of the vertical: no correction; the next one counts for
 *   the time since the last, at most 0.2 s.  A field that never comes: the filter of mahony_q.h.
 * - a field out of heading_gate is a disturbance for heading_timeout, then it is believed.
 * - any length of the field: only its direction counts.
 */
#ifndef FACTORLAB_MAHONY_Q9_H
#define FACTORLAB_MAHONY_Q9_H

#include "mahony_q.h"

#ifdef __cplusplus
extern "C" {
#endif

struct mahony_q9_settings {
    struct mahony_q_settings tilt; /* of the filter without magnetometer */
    float heading_gain;    /* k_H, 1/s; at most 0.19 */
    float heading_gate;    /* rad; 3.2 and more: everything passes */
    float heading_timeout; /* s */
};

struct mahony_q9_derived {
    struct mahony_q_derived tilt; /* of the filter without magnetometer */
    uint16_t heading_gain;    /* k_H times half a period, Q26 */
    int16_t gate;             /* cosine of the gate, Q14 */
    uint16_t timeout_periods; /* periods */
    uint16_t oldest_periods;  /* that one field stands for at most, periods */
};

struct mahony_q9_state {
    struct mahony_q_state tilt; /* of the filter without magnetometer */
    uint16_t field_age;   /* since the last field, periods */
    uint16_t outside;     /* the gate for so long, periods */
    uint8_t heading_known; /* 1: a field has come */
};

/* one more bit of the status */
#define MAHONY_Q_MAG_DISTURBED 0x04U /* the last field was out of the gate */

void mahony_q_defaults_9d(struct mahony_q9_settings *settings);
void mahony_q_derive_9d(const struct mahony_q9_settings *settings, uint16_t rate_hz,
                        struct mahony_q9_derived *derived);
void mahony_q_start_9d(struct mahony_q9_state *state, const struct mahony_q9_derived *derived,
                       const struct imu_q *first);
void mahony_q_step_9d(struct mahony_q9_state *state, const struct mahony_q9_derived *derived,
                      const struct imu_q *sample, uint8_t periods);
void mahony_q_attitude_9d(const struct mahony_q9_state *state, int32_t world_q_body[4] /* Q30 */);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_MAHONY_Q9_H */
