"""What is made of several of a user's functions does what they do one by one."""

import math

import numpy as np
import pytest

import sequential as sq
from sequential.compile import compiled
from sequential.fusing import fused_move, fused_sight, over_points
from sequential.kernels.charts import wrap
from sequential.model import Plain, evaluate
from sequential.models.declared import density_noise


def step(x, u, dt):
    return x[0] + u[0] * dt * math.cos(x[2]), x[1] + u[0] * dt * math.sin(x[2]), x[2] + u[1] * dt


def step_jacobian(x, u, dt):
    c, s = u[0] * dt * math.cos(x[2]), u[0] * dt * math.sin(x[2])
    return (1.0, 0.0, -s), (0.0, 1.0, c), (0.0, 0.0, 1.0)


def step_noise(x, dt):
    return (0.1 * dt, 0.01 * x[0], 0.0), (0.01 * x[0], 0.2 * dt, 0.0), (0.0, 0.0, 0.3 * dt)


def ranges(x):
    return math.hypot(3.0 - x[0], 4.0 - x[1]), x[2]


def ranges_jacobian(x):
    r = math.hypot(3.0 - x[0], 4.0 - x[1])
    return ((x[0] - 3.0) / r, (x[1] - 4.0) / r, 0.0), (0.0, 0.0, 1.0)


FULL, BRIEF = ("x", "u", "dt"), ("x", "dt")
STEP, JACOBIAN = Plain(step, FULL, 3), Plain(step_jacobian, FULL, 9)
DENSITY = np.append(3.0, np.diag([0.1, 0.2, 0.3]).ravel())


@pytest.mark.parametrize(
    ("noise", "params"),
    [(density_noise, DENSITY), (Plain(step_noise, BRIEF, 9, adds=True), np.zeros(1))],
)
def test_a_fused_move_is_the_step_and_f_p_ft_plus_q(rng, noise, params):
    moved = fused_move(STEP, JACOBIAN, noise, 3, 3, 2)
    x, u, dt, a = rng.standard_normal(3), rng.standard_normal(2), 0.1, rng.standard_normal((3, 3))
    p = a @ a.T
    belief = np.append(x, p.ravel())
    moved.ctypes(*(pointer(v) for v in (belief, u)), dt, pointer(params), pointer(belief))
    f = evaluate(JACOBIAN, x, u, dt, params, 9).reshape(3, 3)
    expected = f @ p @ f.T + evaluate(noise, x, u, dt, params, 9).reshape(3, 3)
    np.testing.assert_allclose(belief[:3], step(x, u, dt), rtol=1e-14)
    np.testing.assert_allclose(belief[3:].reshape(3, 3), expected, rtol=1e-13, atol=1e-15)


def pointer(values):
    import ctypes

    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def test_a_fused_sight_is_the_measurement_and_behind_it_its_jacobian(rng):
    sight = fused_sight(Plain(ranges, ("x",), 2), Plain(ranges_jacobian, ("x",), 6), 3, 0)
    x, none, out = rng.standard_normal(3), np.zeros(1), np.empty(8)
    sight.ctypes(pointer(x), pointer(none), 0.0, pointer(none), pointer(out))
    np.testing.assert_allclose(out, [*ranges(x), *np.ravel(ranges_jacobian(x))], rtol=1e-14)


def test_all_sigma_points_at_once_are_each_of_them_alone(rng):
    many = over_points(STEP, 3, 2, 5, 3)
    x, u, out = rng.standard_normal((5, 3)), rng.standard_normal(2), np.empty((5, 3))
    many.ctypes(pointer(x), pointer(u), 0.1, pointer(u), pointer(out))
    np.testing.assert_allclose(out, [step(one, u, 0.1) for one in x], rtol=1e-14)


def test_what_returns_arrays_writes_to_its_arguments_or_is_large_stays_apart():
    def array(x, u, dt):
        return np.array(step(x, u, dt))

    def writing(x, u, dt):
        x[0] += u[0] * dt
        return x[0], x[1], x[2]

    assert fused_move(Plain(array, FULL, 3), JACOBIAN, density_noise, 3, 3, 2) is None
    assert fused_move(Plain(writing, FULL, 3), JACOBIAN, density_noise, 3, 3, 2) is None
    assert fused_move(STEP, JACOBIAN, density_noise, 3, 7, 2) is None
    assert fused_move(STEP, JACOBIAN, print, 3, 3, 2) is None


def test_filters_find_the_same_whether_or_not_a_model_could_be_fused(rng):
    t = 0.1 * np.arange(1, 60)
    z = np.column_stack([5.0 + 0.1 * rng.standard_normal(59), 0.1 * t])
    log = sq.SensorLog({"u": sq.Stream(t, np.tile([1.0, 0.2], (59, 1))), "z": sq.Stream(t, z)})

    def array_jacobian(x, u, dt):
        return np.array(step_jacobian(x, u, dt))

    def array_ranges_jacobian(x):
        return np.array(ranges_jacobian(x))

    def run(*, fused):
        moved, seen = step_jacobian, ranges_jacobian
        if not fused:
            moved, seen = array_jacobian, array_ranges_jacobian
        process = sq.Process(step, noise_density=0.01, jacobian=moved, inputs=2)
        sensor = sq.Sensor(ranges, 0.01, jacobian=seen, manifold=sq.Vector(2))
        model = sq.StateSpace(
            sq.Vector(3), sq.Gaussian([0.0] * 3, [0.1] * 3), process, {"z": sensor}, input="u", start=0
        )
        tables = compiled(model).tables
        assert (tables.advance != 0, tables.see[0] != 0) == (fused, fused)
        return sq.run(sq.ExtendedKalmanFilter(), model, log)

    one, other = run(fused=True), run(fused=False)
    np.testing.assert_allclose(one.mean, other.mean, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(one.cov, other.cov, rtol=1e-9, atol=1e-14)
    assert one.log_likelihood == pytest.approx(other.log_likelihood, rel=1e-10)


@pytest.mark.parametrize("size", [1.0, 10.0, 1e3, 9e5, 1e8])
def test_angles_are_wrapped_as_the_sine_and_the_cosine_say(rng, size):
    for angle in size * (2.0 * rng.random(500) - 1.0):
        apart = wrap(angle) - math.atan2(math.sin(angle), math.cos(angle))
        assert abs(math.remainder(apart, math.tau)) < 1e-15 + 2e-16 * min(size, 1.0) + 1e-22 * size
        assert -math.pi < wrap(angle) <= math.pi


def test_angles_at_the_border_and_without_a_value_keep_their_meaning():
    assert wrap(math.pi) == math.pi
    assert wrap(-math.pi) == pytest.approx(math.pi, abs=1e-15)
    assert wrap(3.0 * math.pi) == pytest.approx(math.pi, abs=1e-14) or wrap(3.0 * math.pi) < -3.14
    assert math.isnan(wrap(math.nan))
