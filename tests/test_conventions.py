"""docs/conventions.md, sentence by sentence; the charts meet GTSAM's in tests/sequential/manifold."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sequential.attitude import attitude_from_vectors, roll_pitch_yaw
from sequential.history import Innovations
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.manifold import SE2, SE3, SO2, SO3, NavState, Product, Vector, rotation_matrix
from sequential.model import Gaussian, StateSpace
from sequential.models import Process, inertial_state
from sequential.noise import ImuNoise
from sequential.timeline import prepare


def test_an_integer_time_is_nanoseconds_and_a_float_seconds():
    assert nanoseconds(1_500_000_000_123_456_789) == 1_500_000_000_123_456_789
    assert nanoseconds(1.5) == 1_500_000_000
    assert nanoseconds([0, 1]).dtype == np.int64


def test_quaternions_are_hamiltons_scalar_first(rng):
    rotation = Rotation.random(rng=rng)
    world_q_body = np.roll(rotation.as_quat(), 1)  # SciPy keeps the scalar last
    np.testing.assert_allclose(rotation_matrix(world_q_body), rotation.as_matrix(), atol=1e-15)


def test_an_attitude_s_world_is_east_north_up():
    """A level sensor whose x axis points north has a yaw of 90°."""
    up, north_and_down = [0.0, 0.0, 9.81], [20.0, 0.0, -40.0]
    world_q_body = attitude_from_vectors(np.array(up), np.array(north_and_down))
    np.testing.assert_allclose(np.degrees(roll_pitch_yaw(world_q_body)), [0.0, 0.0, 90.0], atol=1e-12)
    np.testing.assert_allclose(rotation_matrix(world_q_body) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ("manifold", "size", "dim"),
    [
        (Vector(4), 4, 4),
        (SO2(), 1, 1),
        (SO3(), 4, 3),
        (SE2(), 3, 3),
        (SE3(), 7, 6),
        (NavState(), 10, 9),
        (Product(pose=SE3(), bias=Vector(3)), 10, 9),
    ],
)
def test_storage_and_tangent_sizes(manifold, size, dim):
    assert (manifold.size, manifold.dim) == (size, dim)


def test_a_navigation_state_moves_along_the_axes_of_its_body(rng):
    before = np.concatenate([np.roll(Rotation.random(rng=rng).as_quat(), 1), rng.normal(size=6)])
    turn, dp, dv = rng.normal(size=(3, 3))
    after = NavState().retract(before, np.concatenate([turn, dp, dv]))
    world_R_body = rotation_matrix(before[:4])
    np.testing.assert_allclose(
        rotation_matrix(after[:4]), world_R_body @ Rotation.from_rotvec(turn).as_matrix(), atol=1e-14
    )
    np.testing.assert_allclose(after[4:7], before[4:7] + world_R_body @ dp, atol=1e-14)
    np.testing.assert_allclose(after[7:], before[7:] + world_R_body @ dv, atol=1e-14)


def test_the_accelerometer_bias_comes_before_the_gyro_bias():
    names = list(inertial_state().parts)
    assert names.index("accel_bias") < names.index("gyro_bias")


def test_values_are_read_only_and_vectors_are_one_dimensional():
    stream = Stream([0.0, 1.0], [5.0, 6.0])
    belief = Gaussian([1.0, 2.0], [1.0, 4.0])
    assert stream.values.shape == (2, 1)
    assert (belief.mean.shape, belief.cov.shape) == ((2,), (2, 2))
    for array in (stream.t, stream.values, belief.mean, belief.cov):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_density_becomes_a_sample_deviation_in_one_place():
    noise = ImuNoise(gyro_density=1e-3, accel_density=2e-2, gyro_bias_walk=1e-5, accel_bias_walk=1e-4)
    gyro_rad_s, accel_m_s2 = noise.sample_sigmas(0.01)
    assert gyro_rad_s**2 == pytest.approx(noise.gyro_density**2 / 0.01)
    assert accel_m_s2**2 == pytest.approx(noise.accel_density**2 / 0.01)


def test_kalibrs_names_are_accepted():
    kalibr = {
        "gyroscope_noise_density": 1.0,
        "accelerometer_noise_density": 2.0,
        "gyroscope_random_walk": 3.0,
        "accelerometer_random_walk": 4.0,
    }
    assert ImuNoise.from_kalibr(kalibr) == ImuNoise(1.0, 2.0, 3.0, 4.0)


@pytest.mark.parametrize(("covers", "driven_by"), [("after", [10.0, 20.0]), ("before", [20.0, 30.0])])
def test_an_input_sample_covers_one_side_of_its_stamp(covers, driven_by):
    process = Process(step=lambda x, u, dt: x + u * dt, noise_density=[1.0], inputs=1)
    model = StateSpace(Vector(1), Gaussian([0.0], [1.0]), process, sensors={}, input="speed")
    log = SensorLog({"speed": Stream([0.0, 1.0, 2.0], [10.0, 20.0, 30.0], covers=covers)})
    schedule = prepare(model, log, at=np.array([2.0])).schedule
    np.testing.assert_allclose(schedule.step_dt, [1.0, 1.0])
    np.testing.assert_allclose(schedule.inputs[schedule.step_input, 0], driven_by)


def test_nis_is_the_squared_innovation_in_units_of_its_covariance():
    innovations = Innovations(
        t=np.array([0]),
        row=np.array([0]),
        residual=np.array([[3.0, 4.0]]),
        cov=np.array([np.diag([9.0, 4.0])]),
        accepted=np.array([True]),
    )
    assert innovations.nis() == pytest.approx([5.0])
