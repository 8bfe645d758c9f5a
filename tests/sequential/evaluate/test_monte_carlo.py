"""ANEES over many draws: inside the band where the model is the truth, outside where it is not."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import EVERY_WORLD, LINEAR_WORLDS, constant_velocity, unicycle_range_bias

import sequential as sq
from sequential.errors import ModelError, SolverError
from sequential.evaluate import chi2_band, monte_carlo

RUNS = 200


def draw(world, estimator, runs=RUNS, model=None, seed=1, **more):
    settings = {"inputs": world.inputs, "readings": world.readings, "contexts": world.contexts} | more
    return monte_carlo(
        world.model if model is None else model, estimator, world.t, np.random.default_rng(seed),
        runs=runs, truth=world.model, **settings,
    )  # fmt: skip


LINEAR = [sq.KalmanFilter(), sq.RauchTungStriebel(leave_one_out=False)]


@pytest.mark.parametrize("estimator", LINEAR, ids=lambda e: e.name)
@pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)
def test_a_matched_estimator_is_inside(world, estimator):
    """200 runs: the mean in the band of a single step, and most steps in their own."""
    found = draw(world, estimator)
    d = world.model.manifold.dim
    assert found.verdict == "consistent"
    assert found.nees.runs == RUNS
    assert found.nees.dof == d
    assert found.nees.band == chi2_band(d, RUNS)
    assert found.nees.share_inside > 0.8  # neighbouring steps go together
    for nis in found.nis.values():
        assert nis.inside_band
    np.testing.assert_allclose(found.rmse, found.sigma, rtol=0.25)
    np.testing.assert_array_equal(found.t, sq.log.nanoseconds(world.t))


@pytest.mark.slow
def test_steps_inside_are_ninety_five_in_a_hundred(seeds):
    """Over several sets of 200 runs, so that the steps of one set may go together."""
    world = constant_velocity()
    sets = max(4, len(seeds) // 8)
    shares = [draw(world, sq.KalmanFilter(), seed=[3, k]).nees.share_inside for k in range(sets)]
    assert np.mean(shares) == pytest.approx(0.95, abs=0.02 + 0.06 / np.sqrt(sets))


@pytest.mark.parametrize(("factor", "verdict"), [(0.1, "overconfident"), (10.0, "pessimistic")])
def test_another_process_noise_is_outside(factor, verdict):
    world = constant_velocity()
    process = sq.ConstantVelocity(factor * world.model.process.acceleration_density, axes=2)
    found = draw(world, sq.KalmanFilter(), model=replace(world.model, process=process))
    assert found.verdict == verdict
    assert found.nees.share_inside < 0.3
    assert not found.nis["position"].inside_band
    assert str(found).startswith(f"{verdict}: ANEES ")


@pytest.mark.parametrize("world", [w for w in EVERY_WORLD if not w.linear], ids=repr)
@pytest.mark.slow
def test_curved_worlds_are_nearly_consistent(world):
    found = draw(world, sq.IteratedExtendedKalmanFilter(), runs=15)
    assert 0.8 < found.nees.mean / found.nees.dof < 1.3
    for nis in found.nis.values():
        assert 0.85 < nis.mean / nis.dof < 1.15


def test_one_part_of_a_product():
    world = unicycle_range_bias()
    for part, dof in (("bias", 1), ("pose", 3), ([0, 3], 2)):
        found = draw(world, sq.ExtendedKalmanFilter(), runs=20, part=part)
        assert found.nees.dof == dof
        assert 0.5 < found.nees.mean / dof < 1.8


def test_the_same_seed_draws_the_same():
    world = constant_velocity()
    one, two = (draw(world, sq.KalmanFilter(), runs=3) for _ in range(2))
    np.testing.assert_array_equal(one.nees.average, two.nees.average)


def test_gated_readings_are_counted():
    world = constant_velocity()
    sensor = replace(world.model.sensors["position"], gate=0.9)
    found = draw(world, sq.KalmanFilter(), runs=20, model=replace(world.model, sensors={"position": sensor}))
    assert found.nis["position"].fraction_gated == pytest.approx(0.1, abs=0.06)


def test_what_cannot_be_solved_is_said():
    world = constant_velocity()
    with pytest.raises(ModelError, match="needs two runs or more, got 1"):
        draw(world, sq.KalmanFilter(), runs=1)

    class Refuses:
        name = "refuses"

        def solve(self, problem):
            raise SolverError("no")

    with pytest.raises(SolverError, match="3 of 3 draws could not be solved; the first said: no"):
        draw(world, Refuses(), runs=3)
