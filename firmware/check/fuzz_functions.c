/* What of the core keeps no state, on any bytes: calibration, angles, frames and lines.
 *
 * Calibration takes any matrix and offset as well, so that a constant a user made up overflows nothing: it saturates.
 * Frames and lines are written into exactly the room that their headers promise to be enough, so that the
 * address sanitizer sees one byte more.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "angles_f32.h"
#include "calibration_f32.h"
#include "calibration_q.h"
#include "frame.h"
#include "text.h"
#include "trig_f32.h"
#include "trig_q.h"

struct words {
    struct affine_q affine_q;
    struct affine_f32 affine_f32;
    int32_t q[4], bias[3], y, x;
    int16_t raw[3], angles[3], counts[7];
    uint16_t sequence;
    uint32_t t_us;
    struct boot_facts facts;
    float quaternion[4], angle;
    uint8_t status;
};

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int truth, const char *what)
{
    if (!truth) {
        fprintf(stderr, "%s\n", what);
        __builtin_trap();
    }
}

static void calibrations_and_angles(const struct words *in)
{
    int32_t wide[3];
    int16_t narrow[3];
    float single[3], sine, cosine;
    uint32_t length;
    calibrate_q24(&in->affine_q, in->raw, wide);
    calibrate_q8(&in->affine_q, in->raw, narrow);
    calibrate_f32(&in->affine_f32, in->raw, single);
    angles_q(in->q, narrow);
    (void)atan2_q(in->y, in->x);
    (void)polar_q32(in->y, in->x, &length);
    (void)asin_q(in->y);
    sincos_q((uint32_t)in->y, &wide[0], &wide[1]);
    angles_f32(in->quaternion, single);
    sin_cos_f32(in->angle, &sine, &cosine);
    require(!(fabsf(sine) > 1.000001f), "a sine is more than 1");
    require(!(fabsf(wrapped_f32(in->angle)) > 3.1416f), "a wrapped angle is more than pi");
    require(!(fabsf(atan2_f32(in->quaternion[0], in->quaternion[1])) > 3.1416f), "an angle is more than pi");
    require(!(decay_f32(fabsf(in->angle)) > 1.000001f), "a share is more than 1");
}

static void frames_and_lines(const struct words *in)
{
    uint8_t *const frame = malloc(FRAME_LARGEST), *const line = malloc(TEXT_LARGEST);
    require(frame_quaternion(frame, in->sequence, in->t_us, in->q, in->bias, in->status) <= FRAME_LARGEST, "frame");
    require(frame_angles(frame, in->sequence, in->t_us, in->angles, in->bias, in->status) <= FRAME_LARGEST, "frame");
    require(frame_raw(frame, in->sequence, in->t_us, in->counts, in->status) <= FRAME_LARGEST, "frame");
    require(frame_boot(frame, in->sequence, in->t_us, &in->facts) <= FRAME_LARGEST, "frame");
    require(text_attitude(line, in->sequence, in->t_us, in->angles) <= TEXT_LARGEST, "line");
    free(frame);
    free(line);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct words in;
    memset(&in, 0, sizeof in);
    memcpy(&in, data, size < sizeof in ? size : sizeof in);
    calibrations_and_angles(&in);
    frames_and_lines(&in);
    return 0;
}
