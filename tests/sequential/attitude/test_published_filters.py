"""Mahony's and Madgwick's filters beside other people's code of them."""

import imufusion
import numpy as np
import pytest
from ahrs import filters as ahrs_filters
from attitude_worlds import seen

from sequential.attitude import Madgwick, Mahony, attitude_from_angles
from sequential.evaluate import attitude_error
from sequential.manifold.quaternion import quaternion_inverse, quaternion_multiply
from sequential.sensors import ImuRecording

RATE = 200.0
NORTH_WEST = attitude_from_angles([0.0, 0.0, np.pi / 2])  # from a world with x north into ours


@pytest.fixture(name="samples")
def some_samples(rng):
    """Gyro, specific force and field (N, 3) that contradict each other, with their stamps in seconds."""
    count = 300
    turning = np.cumsum(0.15 * rng.normal(size=(count, 3)), axis=0)
    accel = np.array([0.5, -1.0, 9.5]) + rng.normal(size=(count, 3))
    return np.arange(count) / RATE, turning, accel, [10.0, 15.0, -40.0] + 3 * rng.normal(size=(count, 3))


def single_steps(filt, samples, mag):
    """Ours: from every attitude of our own path, one step on, (N - 1, 4), beside where it began."""
    t, gyro, accel, field = samples
    path = filt.estimate(ImuRecording(t, accel, gyro, field if mag else None)).world_q_body
    return path[:-1], path[1:]


@pytest.mark.parametrize("mag", [False, True])
def test_every_step_is_that_of_ahrs_madgwick(samples, mag):
    before, after = single_steps(Madgwick.as_published(0.3), samples, mag)
    peer = ahrs_filters.Madgwick(frequency=RATE, gain=0.3)
    _, gyro, accel, field = samples
    for k, (start, end) in enumerate(zip(before, after, strict=True), start=1):
        q = quaternion_multiply(quaternion_inverse(NORTH_WEST), start)
        theirs = (
            peer.updateMARG(q, gyro[k], accel[k], field[k]) if mag else peer.updateIMU(q, gyro[k], accel[k])
        )
        turned = quaternion_multiply(NORTH_WEST, np.array(theirs, dtype=float))
        np.testing.assert_allclose(np.sign(turned @ end) * turned, end, atol=1e-9)


@pytest.mark.parametrize("mag", [False, True])
def test_the_whole_path_is_that_of_ahrs_mahony(samples, mag):
    filt = Mahony.as_published(0.9, 0.2)
    t, gyro, accel, field = samples
    ours = filt.estimate(ImuRecording(t, accel, gyro, field if mag else None))
    peer = ahrs_filters.Mahony(
        gyr=gyro, acc=accel, mag=field if mag else None, frequency=RATE, k_P=0.9, k_I=0.2,
        q0=ours.world_q_body[0],
    )  # fmt: skip
    theirs = np.sign(np.sum(peer.Q * ours.world_q_body, axis=1))[:, None] * peer.Q
    np.testing.assert_allclose(ours.world_q_body, theirs, atol=1e-9)
    np.testing.assert_allclose(ours.gyro_bias[-1], peer.b, atol=1e-9)


def test_on_slow_motion_imufusion_sees_the_same_vertical(rng):
    t = np.arange(0, 30, 1 / RATE)
    angles = np.column_stack([0.4 * np.sin(0.5 * t), 0.3 * np.cos(0.4 * t), 0.2 * t])
    truth = attitude_from_angles(angles)
    recording = seen(t, truth, mag=False, rng=rng)
    peer = imufusion.Ahrs()
    settings = imufusion.AhrsSettings()
    settings.sample_rate = RATE
    peer.set_settings(settings)
    theirs = []
    for gyro, accel in zip(np.degrees(recording.gyro), recording.accel / 9.81, strict=True):
        peer.update_no_magnetometer(gyro, accel)
        theirs.append(peer.get_quaternion())
    for filt in (Mahony(), Madgwick()):
        ours = filt.estimate(recording).world_q_body
        late = t > 5
        assert attitude_error(ours, np.array(theirs), late).degrees[2] < 0.6
