/* The filter that an image was built with, behind one interface: filter_<name>.c for each, chosen by
 * FILTER=<name>.
 *
 * Counts of the sensor are calibrated here, by the constants of FACTORLAB_CALIBRATION.  What it does with bad
 * input: see the header of the filter in core/; `periods` > 1 after periods without a sample.
 */
#ifndef FACTORLAB_FILTER_H
#define FACTORLAB_FILTER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

extern const uint8_t filter_kind;              /* BOOT_NO_FILTER ... of core/frame.h */
extern const uint32_t filter_calibration_hash; /* first 4 bytes of the SHA-256 of its file, 0: none */

/* Constants from settings; the attitude is the identity until the first sample. */
void filter_start(void);

/* One sample in two calls: its accelerometer, as soon as that is known, then its gyro, with which the filter
 * is updated, `periods` after the sample before; the first aligns the filter. */
void filter_accel(const int16_t accel[3] /* counts */);
void filter_update(const int16_t gyro[3] /* counts */, uint8_t periods);

void filter_attitude(int32_t world_q_body[4] /* Q30 */);
void filter_bias(int32_t bias[3] /* rad/s, Q24 */);
uint8_t filter_status(void); /* FRAME_REST | FRAME_ACCEL_REJECTED */

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_FILTER_H */
