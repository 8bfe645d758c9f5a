"""A pose that follows its twist: the step is SE(3)'s exponential, and its derivatives meet differences."""

import numpy as np
import pytest

from sequential import SE2, SE3, Gaussian, Product, StateSpace, Vector
from sequential.driven_pose import DrivenPose
from sequential.errors import ModelError
from sequential.jacobians import difference
from sequential.model import evaluate

WHOLE = Product(bias=Vector(6), pose=SE3(), sway=Vector(4))
DENSITY = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
BIASED = DrivenPose(DENSITY, bias="bias", forgotten={"sway": (0.7, [0.1, 0.2, 0.3, 0.4]), "bias": (5.0, 0.2)})


def call(process, manifold, role, x, u, dt, size):
    f = process.functions(manifold)
    return evaluate(getattr(f, role), x, u, dt, f.params, size)


def test_a_step_is_the_exponential(rng):
    for dt in (1e-6, 0.05, 1.0):
        x, u = SE3().random(rng, 2.0), rng.standard_normal(6)
        np.testing.assert_allclose(
            call(DrivenPose(DENSITY), SE3(), "value", x, u, dt, 7), SE3().retract(x, u * dt), atol=1e-13
        )


def test_two_halves_are_a_whole(rng):
    x, u, process = SE3().random(rng, 2.0), rng.standard_normal(6), DrivenPose(DENSITY)
    half = call(process, SE3(), "value", x, u, 0.4, 7)
    np.testing.assert_allclose(
        call(process, SE3(), "value", half, u, 0.4, 7),
        call(process, SE3(), "value", x, u, 0.8, 7),
        atol=1e-13,
    )


@pytest.mark.parametrize(("process", "manifold"), [(DrivenPose(DENSITY), SE3()), (BIASED, WHOLE)])
@pytest.mark.parametrize("dt", [1e-3, 0.1, 1.0, 4.0])
def test_jacobians_meet_differences(process, manifold, dt, rng):
    d, u = manifold.dim, rng.standard_normal(6)

    def step(at):
        return call(process, manifold, "value", at, u, dt, manifold.size)

    for _ in range(5):
        x = manifold.random(rng, 1.0)
        declared = call(process, manifold, "jacobian", x, u, dt, d * d).reshape(d, d)
        expected = difference(step, x, manifold, manifold)
        np.testing.assert_allclose(declared, expected, atol=2e-8 * max(1.0, np.abs(expected).max()))


def test_noise_is_the_density_over_time_and_what_is_forgotten_comes_to_rest(rng):
    x, u = WHOLE.random(rng, 0.3), np.zeros(6)
    grown = call(BIASED, WHOLE, "noise", x, u, 0.5, 256).reshape(16, 16)
    np.testing.assert_allclose(grown[6:12, 6:12], 0.5 * np.diag(DENSITY), atol=1e-15)
    rest = call(BIASED, WHOLE, "noise", x, u, 1e3, 256).reshape(16, 16)
    np.testing.assert_allclose(np.diag(rest)[12:], np.square([0.1, 0.2, 0.3, 0.4]))
    long = call(BIASED, WHOLE, "value", x, u, 1e3, WHOLE.size)
    np.testing.assert_allclose(long[WHOLE.storage("sway")], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("process", "manifold", "words"),
    [
        (DrivenPose(DENSITY), SE2(), "DrivenPose needs"),
        (DrivenPose([1.0, 2.0]), SE3(), "six variances"),
        (DrivenPose(-DENSITY), SE3(), "six variances"),
        (DrivenPose(DENSITY, bias="sway"), WHOLE, "'sway' has 4 numbers, 6 are needed"),
        (DrivenPose(DENSITY, forgotten={"sway": (0.0, 1.0)}), WHOLE, "time constant above zero"),
    ],
)
def test_what_does_not_fit_is_a_sentence(process, manifold, words):
    with pytest.raises(ModelError, match=words):
        process.functions(manifold)


def test_it_needs_an_input():
    with pytest.raises(ModelError, match="driven by an input"):
        StateSpace(SE3(), Gaussian(SE3().identity(), np.ones(6)), DrivenPose(DENSITY), {})
