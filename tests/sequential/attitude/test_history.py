import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sequential.attitude import (
    AttitudeHistory,
    attitude_from_angles,
    attitude_from_vectors,
    euler_rates,
    roll_pitch_yaw,
    tilt,
)
from sequential.errors import ShapeError
from sequential.manifold.quaternion import quaternion_exp, quaternion_inverse, quaternion_multiply, rotate

NORTH_AND_DOWN = np.array([0.0, 20.0, -44.0])


def angles(rng, count):
    return np.column_stack(
        [rng.uniform(-3.1, 3.1, count), rng.uniform(-1.5, 1.5, count), rng.uniform(-3.1, 3.1, count)]
    )


def test_angles_and_quaternions_are_two_ways_to_say_one_thing(rng):
    given = angles(rng, 100)
    q = attitude_from_angles(given)
    np.testing.assert_allclose(roll_pitch_yaw(q), given, atol=1e-9)
    other = Rotation.from_euler("ZYX", given[:, ::-1])
    np.testing.assert_allclose(
        (other.inv() * Rotation.from_quat(q, scalar_first=True)).magnitude(), 0.0, atol=1e-12
    )


def test_gravity_and_the_field_give_the_attitude(rng):
    given = angles(rng, 100)
    body_q_world = quaternion_inverse(attitude_from_angles(given))
    accel = rotate(body_q_world, np.array([0.0, 0.0, 9.81]))
    mag = rotate(body_q_world, NORTH_AND_DOWN)
    np.testing.assert_allclose(tilt(accel), given[:, :2], atol=1e-9)
    np.testing.assert_allclose(roll_pitch_yaw(attitude_from_vectors(accel, mag)), given, atol=1e-9)
    np.testing.assert_allclose(
        roll_pitch_yaw(attitude_from_vectors(accel)), given * [1.0, 1.0, 0.0], atol=1e-9
    )


def test_euler_rates_are_the_derivative_of_the_angles(rng):
    given, rate, dt = angles(rng, 30), rng.normal(size=(30, 3)), 1e-6
    q = attitude_from_angles(given)
    ahead, behind = (roll_pitch_yaw(quaternion_multiply(q, quaternion_exp(s * dt * rate))) for s in (1, -1))
    expected = np.einsum("nij,nj->ni", euler_rates(given), rate)
    np.testing.assert_allclose((ahead - behind) / (2 * dt), expected, rtol=1e-4, atol=1e-4)


def test_a_history_is_sealed_and_gives_angles_with_sigmas(rng):
    given = angles(rng, 6)
    cov = np.tile(np.diag([1e-4, 4e-4, 9e-4]), (6, 1, 1))
    q = attitude_from_angles(given)
    history = AttitudeHistory(np.arange(6) * 10_000_000, q, cov=cov, rest=np.arange(6) > 2)
    q[:] = 0.0
    np.testing.assert_allclose(history.roll_pitch_yaw(), given, atol=1e-9)
    assert not history.world_q_body.flags.writeable
    assert not history.rest.flags.writeable
    np.testing.assert_allclose(history.seconds, np.arange(6) * 0.01)
    level = AttitudeHistory(history.t[:1], [[1.0, 0.0, 0.0, 0.0]], cov=cov[:1])
    np.testing.assert_allclose(level.roll_pitch_yaw_sigmas(), [[0.01, 0.02, 0.03]])
    assert AttitudeHistory(history.t, history.world_q_body).roll_pitch_yaw_sigmas() is None


def test_only_what_is_read_only_already_is_not_copied():
    t, q = np.arange(3), attitude_from_angles(np.zeros((3, 3)))
    copied = AttitudeHistory(t, q)
    q[:] = 0.5
    t[:] = 7
    np.testing.assert_array_equal(copied.world_q_body[:, 0], 1.0)
    np.testing.assert_array_equal(copied.t, [0, 1, 2])
    q.flags.writeable = False
    assert AttitudeHistory(copied.t, q).world_q_body is q
    assert AttitudeHistory(copied.t, q[:, :]).t is copied.t
    turned = np.asfortranarray(q)
    turned.flags.writeable = False
    assert AttitudeHistory(copied.t, turned).world_q_body.flags.c_contiguous


def test_sigmas_are_those_of_a_sample(rng):
    one = np.array([0.4, -0.7, 2.0])
    root = 1e-3 * rng.normal(size=(3, 3))
    drawn = quaternion_multiply(
        attitude_from_angles(one), quaternion_exp(rng.normal(size=(20_000, 3)) @ root.T)
    )
    said = AttitudeHistory(
        [0], attitude_from_angles(one)[None], cov=(root @ root.T)[None]
    ).roll_pitch_yaw_sigmas()
    np.testing.assert_allclose(said[0], roll_pitch_yaw(drawn).std(axis=0), rtol=0.03)


def test_wrong_shapes_are_told_in_a_sentence():
    with pytest.raises(ShapeError, match=r"world_q_body has shape \(3, 4\) for 3 stamps"):
        AttitudeHistory([0, 1, 2], np.ones((2, 4)))
    with pytest.raises(ShapeError, match="rest"):
        AttitudeHistory([0], [[1.0, 0.0, 0.0, 0.0]], rest=[True, False])
