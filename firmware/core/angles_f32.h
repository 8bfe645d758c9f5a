/* Roll, pitch and yaw of a quaternion, in single precision.
 *
 * R = Rz(yaw) Ry(pitch) Rx(roll) turns body into world coordinates, with z up in both, as in
 * sequential.attitude.roll_pitch_yaw.  The pitch is taken from sine and cosine, so that it keeps its digits
 * at +-90 degrees, where the sine alone loses half of them; roll and yaw lose their meaning there.
 *
 * Cost: firmware/budget.csv.
 *
 * What it does with bad input: a quaternion that is not of length 1 counts as one of the same direction as
 * long as its length is within 1e-3 of 1; NaN gives NaN.
 */
#ifndef FACTORLAB_ANGLES_F32_H
#define FACTORLAB_ANGLES_F32_H

#ifdef __cplusplus
extern "C" {
#endif

/* Roll and yaw in [-pi, pi], pitch in [-pi/2, pi/2], rad. */
void angles_f32(const float world_q_body[4], float roll_pitch_yaw[3]);

/* The other way: w x y z of roll, pitch and yaw, rad. */
void attitude_from_angles_f32(const float roll_pitch_yaw[3], float world_q_body[4]);

#ifdef __cplusplus
}
#endif

#endif /* FACTORLAB_ANGLES_F32_H */
