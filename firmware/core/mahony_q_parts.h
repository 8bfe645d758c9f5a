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
void mahony_q_update(struct mahony_q_state *state, const struct mahony_q_derived *derived, const struct imu_q *sample,
                     const struct mahony_q_weights *weights, uint16_t gain);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_MAHONY_Q_PARTS_H */
