"""EKF-SLAM beside other ways to the same numbers, and beside the truth."""

from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import carried, last_nees, loops

from sequential.errors import ModelError, UnderConstrainedError
from sequential.evaluate import chi2_band
from sequential.manifold import SE2, SE3, Vector
from sequential.slam import EkfSlam, Factors, SlamProblem
from sequential.slam.arrivals import Reading, linearised
from sequential.slam.models import Between, Displacement, LandmarkRange, MarkerCorners, Prior
from vision3d.camera import Camera


def linear_world(rng, steps=25, landmarks=4):
    """Points on a line of their own, offsets between them, all with noise: linear from end to end."""
    v = Vector(2)
    x = np.cumsum(rng.standard_normal((steps, 2)), axis=0)
    places = 5.0 * rng.standard_normal((landmarks, 2))
    rows, seen = np.arange(steps - 1), rng.integers(0, landmarks, 3 * steps)
    at = np.repeat(np.arange(steps), 3)
    cov = np.array([[0.04, 0.01], [0.01, 0.09]])
    noise = np.linalg.cholesky(cov)

    def drawn(count):
        return rng.standard_normal((count, 2)) @ noise.T

    moves, offsets = np.diff(x, axis=0) + drawn(steps - 1), places[seen] - x[at] + drawn(len(at))
    factors = (
        Factors(Prior(v), ("x",), [[0]], x[:1] + drawn(1), cov),
        Factors(Between(v), ("x", "x"), np.stack([rows, rows + 1], 1), moves, cov),
        Factors(Between(v), ("x", "l"), np.stack([at, seen], 1), offsets, cov),
    )
    return SlamProblem({"x": v, "l": v}, factors)


def gauss_newton_step(problem, value):
    """One dense step at given values: values moved, and the covariance, by variable."""
    variables = sorted(value)
    start = dict(zip(variables, np.cumsum([0] + [problem.kinds[v[0]].dim for v in variables]), strict=False))
    total = sum(problem.kinds[v[0]].dim for v in variables)
    information, gradient = np.zeros((total, total)), np.zeros(total)
    for number, group in enumerate(problem.factors):
        for row, index in enumerate(np.asarray(group.index).tolist()):
            reading = Reading(number, row, tuple(zip(group.slots, index, strict=True)))
            rows = linearised(group, [reading], value)
            jacobian = np.zeros((rows.error.shape[1], total))
            for v, j in zip(reading.variables, rows.jacobians, strict=True):
                jacobian[:, start[v] : start[v] + j.shape[2]] = j[0]
            weight = np.linalg.inv(rows.noise[0])
            information += jacobian.T @ weight @ jacobian
            gradient -= jacobian.T @ weight @ rows.error[0]
    cov = np.linalg.inv(information)
    step = cov @ gradient
    moved, covs = {}, {}
    for v in variables:
        at = slice(start[v], start[v] + problem.kinds[v[0]].dim)
        moved[v], covs[v] = problem.kinds[v[0]].retract(value[v], step[at]), cov[at, at]
    return moved, covs


@pytest.mark.parametrize("linearisation", ["standard", "first_estimates"])
def test_on_a_linear_problem_it_is_the_batch(rng, linearisation):
    problem = linear_world(rng)
    run = EkfSlam(linearisation).solve(problem)
    last = run.values.index["x"][-1]
    value = {("x", int(k)): np.zeros(2) for k in run.values.index["x"]}
    value |= {("l", int(j)): np.zeros(2) for j in run.values.index["l"]}
    batch, covs = gauss_newton_step(problem, value)
    np.testing.assert_allclose(run.values.rows["x"][-1], batch["x", last], atol=1e-10)
    np.testing.assert_allclose(run.covs["x"][-1], covs["x", last], atol=1e-10)
    for j, place, cov in zip(run.values.index["l"], run.values.rows["l"], run.covs["l"], strict=True):
        np.testing.assert_allclose(place, batch["l", j], atol=1e-10)
        np.testing.assert_allclose(cov, covs["l", j], atol=1e-10)


def test_holding_every_pose_smooths_a_linear_problem(rng):
    problem = linear_world(rng)
    held = {}
    EkfSlam(keep=None, watch=lambda _, belief: held.update(belief.value)).solve(problem)
    batch, _ = gauss_newton_step(problem, {v: np.zeros(2) for v in held})
    for variable, value in held.items():
        np.testing.assert_allclose(value, batch[variable], atol=1e-9)


def test_one_update_is_one_gauss_newton_step_from_the_prediction(rng):
    """All readings of a step together, on SE(2), with a landmark's place as wide as the pose's."""
    world = loops(rng, steps=2, landmarks=8, turns=0.02, reach=20.0)
    start, odometry, sightings = world.problem.factors
    known = Factors(
        Prior(Vector(2)),
        ("l",),
        np.arange(8)[:, None],
        world.landmarks + 0.3 * rng.standard_normal((8, 2)),
        0.09,
        step=np.zeros(8),
    )
    late = np.asarray(sightings.index)[:, 0] == 1
    sightings = replace(sightings, index=np.asarray(sightings.index)[late], z=np.asarray(sightings.z)[late])
    problem = replace(world.problem, factors=(start, known, odometry, sightings))
    first = np.asarray(start.z)[0]
    predicted = {("x", 0): first, ("x", 1): odometry.model.place(1, odometry.z, first[None], None)[0]}
    predicted |= {("l", j): z for j, z in enumerate(np.asarray(known.z))}
    batch, covs = gauss_newton_step(problem, predicted)
    run = EkfSlam().solve(problem)
    np.testing.assert_allclose(run.values.rows["x"][1], batch["x", 1], atol=1e-12)
    np.testing.assert_allclose(run.covs["x"][1], covs["x", 1], atol=1e-12)
    for j in range(8):
        np.testing.assert_allclose(run.values.rows["l"][j], batch["l", j], atol=1e-12)
        np.testing.assert_allclose(run.covs["l"][j], covs["l", j], atol=1e-12)


def test_more_numbers_than_a_variable_has_are_all_used(rng):
    """A marker's corners are eight numbers for six: what is left over corrects the camera."""
    se3, camera = SE3(), Camera.from_matrix(np.array([[500.0, 0, 320], [0, 500.0, 240], [0, 0, 1]]))
    model = MarkerCorners(camera, 0.2)
    pose = se3.retract(se3.identity(), 0.05 * rng.standard_normal(6))
    marker = np.array([[0.0, 1.0, 0.0, 0.0, 0.1, -0.05, 1.5]])
    z = model.expected(pose[None], marker) + 0.5 * rng.standard_normal((1, 8))
    prior = Factors(Prior(se3), ("x",), [[0]], pose[None], np.diag([0.01, 0.02, 0.03, 0.1, 0.2, 0.3]) ** 2)
    problem = SlamProblem({"x": se3, "m": se3}, (prior, Factors(model, ("x", "m"), [[0, 0]], z, 0.25)))
    seen = {}
    EkfSlam(watch=lambda _, belief: seen.update(belief.first)).solve(problem)
    batch, covs = gauss_newton_step(problem, seen)
    run = EkfSlam().solve(problem)
    for kind in ("x", "m"):
        np.testing.assert_allclose(run.values.rows[kind][0], batch[kind, 0], atol=1e-9)
        np.testing.assert_allclose(run.covs[kind][0], covs[kind, 0], rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize("linearisation", ["standard", "first_estimates", "invariant"])
def test_moving_the_world_moves_the_estimate(rng, linearisation):
    world = loops(rng, steps=40, turns=1.2)
    motion = np.array([3.0, -20.0, 2.0])
    start = world.problem.factors[0]
    moved = replace(start, z=carried(np.asarray(start.z), motion))
    run = EkfSlam(linearisation).solve(world.problem)
    other = EkfSlam(linearisation).solve(replace(world.problem, factors=(moved, *world.problem.factors[1:])))
    expected = carried(run.values.rows["x"], motion)
    np.testing.assert_allclose(other.values.rows["x"], expected, atol=1e-8)
    np.testing.assert_allclose(other.covs["x"], run.covs["x"], atol=1e-9)


@pytest.mark.slow
def test_only_the_repaired_filters_know_how_wrong_they_are(seeds):
    """Loops among landmarks: the plain filter is overconfident, the two repairs are not."""
    values = {"standard": [], "first_estimates": [], "invariant": []}
    for seed in seeds:
        world = loops(np.random.default_rng(seed), steps=60, scale=2.0)
        for name, found in values.items():
            found.append(last_nees(EkfSlam(name).solve(world.problem), world))
    _, high = chi2_band(3, len(seeds), 0.999)
    assert np.mean(values["standard"]) > high
    assert np.mean(values["invariant"]) < high
    assert np.mean(values["first_estimates"]) < np.mean(values["standard"])


def test_innovations_are_of_the_size_that_they_claim(rng):
    world = loops(rng, steps=60, turns=0.6)
    run = EkfSlam("invariant").solve(world.problem)
    nis = run.innovations["2"].nis()
    low, high = chi2_band(2, len(nis), 0.9999)
    assert low < nis.mean() < high


def test_a_gate_rejects_and_counts(rng):
    world = loops(rng, steps=40, turns=0.6)
    start, odometry, sightings = world.problem.factors
    z = np.array(sightings.z)
    z[-1] += [3.0, 1.0]
    problem = replace(world.problem, factors=(start, odometry, replace(sightings, z=z, gate=0.99999)))
    run = EkfSlam().solve(problem)
    assert run.report.rejected == 1
    assert not run.innovations["2"].accepted[-1]


def test_a_loop_closure_to_a_pose_left_behind_is_refused(rng):
    world = loops(rng, steps=30)
    closure = Factors(Between(SE2()), ("x", "x"), [[3, 29]], np.zeros((1, 3)), 0.1, name="closure")
    problem = replace(world.problem, factors=(*world.problem.factors, closure))
    with pytest.raises(ModelError, match=r"measurement 0 of closure arrives at step 29 and joins x3.*graph"):
        EkfSlam().solve(problem)
    kept = EkfSlam(keep=None).solve(problem)
    assert kept.values.index["x"][-1] == 29


def test_a_pose_that_nothing_places_is_named():
    problem = SlamProblem(
        {"x": SE2(), "l": Vector(2)},
        (Factors(Displacement(SE2()), ("x", "l"), [[0, 0]], np.ones((1, 2)), 0.1),),
    )
    with pytest.raises(UnderConstrainedError, match="nothing says where x0 is"):
        EkfSlam().solve(problem)


def test_a_reading_that_places_nothing_is_said(rng):
    prior = Factors(Prior(SE2()), ("x",), [[0]], np.zeros((1, 3)), 0.1)
    step = Factors(Between(SE2()), ("x", "x"), [[0, 1]], np.ones((1, 3)), 0.1)
    far = Factors(LandmarkRange(), ("x", "l"), [[0, 0], [1, 0]], [[5.0], [5.0]], 0.1)
    run = EkfSlam().solve(SlamProblem({"x": SE2(), "l": Vector(2)}, (prior, step, far)))
    assert "2 readings were not used" in run.report.message
    assert "l" not in run.values.rows


def test_settings_are_checked():
    with pytest.raises(ModelError, match="linearisation is one of"):
        EkfSlam("exact")
    with pytest.raises(ModelError, match="keep counts steps"):
        EkfSlam(keep=-1)
