/* For Frama-C's EVA: fixed-point angles and calibration, on any input there is.
 *
 * `make -C firmware/check prove` shows that no signed overflow, no shift out of range and no access out of bounds can
 * happen in them: the analysis ends without an alarm.  Quaternions are within +-1 (Q30), as trig_q.h asks; all
 * else is any bits.  The filters are not proved: their states need invariants that EVA does not find by itself; the
 * fuzzer sets those states instead.
 */
#include <stdint.h>

#include "__fc_builtin.h"
#include "calibration_q.h"
#include "trig_q.h"

#define ONE INT32_C(1073741824) /* Q30 */

static int32_t any32(void)
{
    return (int32_t)Frama_C_interval(INT32_MIN, INT32_MAX);
}

int main(void)
{
    struct affine_q affine;
    int32_t q[4], wide[3], sine, cosine;
    int16_t raw[3], narrow[3];
    uint32_t length;
    for (int i = 0; i < 4; i++) {
        q[i] = (int32_t)Frama_C_interval(-ONE, ONE);
    }
    for (int i = 0; i < 3; i++) {
        raw[i] = (int16_t)Frama_C_interval(INT16_MIN, INT16_MAX);
        affine.shift[i] = any32();
        for (int j = 0; j < 3; j++) {
            affine.matrix[i][j] = any32();
        }
    }
    angles_q(q, narrow);
    calibrate_q24(&affine, raw, wide);
    calibrate_q8(&affine, raw, narrow);
    sincos_q((uint32_t)any32(), &sine, &cosine);
    (void)atan2_q(any32(), any32());
    (void)polar_q32(any32(), any32(), &length);
    (void)asin_q((int32_t)Frama_C_interval(-ONE, ONE));
    return 0;
}
