/* The parts of mahony_q's step that stand alone: for mahony_q.c and mahony_q9.c, not for users.
 *
 * On an AVR `mahony_q_update` is assembler (mahony_q_avr.c), bit for bit the C of mahony_q_update.c.
 */
#ifndef FACTORLAB_MAHONY_Q_PARTS_H
#define FACTORLAB_MAHONY_Q_PARTS_H

#include "mahony_q.h"
#include "turning_q.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One sample that stands for weights->periods > 0 periods; gain is k_P times half a period, Q18. */
void mahony_q_update(struct mahony_q_state *state, const struct mahony_q_derived *derived,
                     const struct imu_q *sample, const struct mahony_q_weights *weights, uint16_t gain);

/* What a magnetometer adds, about the vertical. */
struct mahony_q_heading {
    int32_t half; /* half the angle to turn by in each period, rad, Q32 */
    int32_t bias; /* to take from the bias in all, rad/s, Q32; both below 2^27 */
};

/* The same in C everywhere, with a heading; NULL: none. */
void mahony_q_update_heading(struct mahony_q_state *state, const struct mahony_q_derived *derived,
                             const struct imu_q *sample, const struct mahony_q_weights *weights,
                             uint16_t gain, const struct mahony_q_heading *heading);

/* What a sample is worth that stands for periods != 0; `several` is where it is put unless that is 1.
 * Counts the quick start down; gives the gain. */
uint16_t mahony_q_worth(struct mahony_q_state *state, const struct mahony_q_derived *derived,
                        uint8_t periods, struct mahony_q_weights *several);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_MAHONY_Q_PARTS_H */
