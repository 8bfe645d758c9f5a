"""What estimates are worth: a step of the filter, marginals, robust losses, NEES, landmarks that wait."""

from dataclasses import replace

import numpy as np
import pytest
from graph_slam_worlds import displaced, loop, pose_graph

from factorlab.graph.slam import BatchSlam, FixedLagSlam, IncrementalSlam
from sequential.manifold import SE2, SE3, SO2, SO3, Vector
from sequential.model import Loss
from sequential.models import Position
from sequential.slam import EkfSlam, Factors, SlamProblem
from sequential.slam.models import (
    Between,
    LandmarkBearing,
    LandmarkRange,
    LandmarkRangeBearing,
    OfSensor,
    Prior,
    Projection,
)
from vision3d.camera import Camera


def one_update(rng, model):
    """A pose, a step, and a sighting of a landmark that is known a little: one update of a filter."""
    place = np.array([[3.0, 1.0]])
    pose = np.array([[0.5, -0.2, 0.1]])
    moved = np.array([[0.4, 0.1, 0.3]])
    z = model.expected(SE2().retract(pose, moved), place) + 0.1 * rng.standard_normal(
        (1, model.measured.size)
    )
    factors = (
        Factors(Prior(SE2()), ("x",), [[0]], pose, np.diag([0.01, 0.02, 0.005]), step=[0]),
        Factors(Prior(Vector(2)), ("l",), [[0]], place + 0.1, np.diag([0.3, 0.2]), step=[0]),
        Factors(Between(SE2()), ("x", "x"), [[0, 1]], moved, np.diag([0.02, 0.01, 0.004])),
        Factors(model, ("x", "l"), [[1, 0]], z, 0.02 * np.eye(model.measured.dim)),
    )
    return SlamProblem({"x": SE2(), "l": Vector(2)}, factors)


@pytest.mark.parametrize("model", [LandmarkRangeBearing(), LandmarkBearing(), LandmarkRange()], ids=str)
@pytest.mark.parametrize("route", ["native", "batched"])
def test_a_step_of_the_filter_is_a_step_of_gauss_newton(model, route, rng):
    problem = one_update(rng, model)
    step = BatchSlam(route=route, max_iterations=1, check=False, covariance=False).solve(problem)
    filtered = EkfSlam().solve(problem)
    for kind, manifold in problem.kinds.items():
        apart = manifold.local(filtered.values.rows[kind][-1], step.values.rows[kind][-1])
        np.testing.assert_allclose(apart, 0.0, atol=1e-10)


@pytest.mark.parametrize("world", [loop, displaced])
def test_the_newest_pose_has_the_marginal_of_the_batch(world, rng):
    problem = world(rng)[0]
    batch = BatchSlam().solve(problem)
    for estimator in (IncrementalSlam(threshold=1e-5), FixedLagSlam(500, threshold=1e-5)):
        online = estimator.solve(problem).online
        # what the last measurements moved has not been relinearised yet
        scale = np.sqrt(np.diag(batch.covs["x"][-1]))
        off = (online.cov[-1] - batch.covs["x"][-1]) / np.outer(scale, scale)
        np.testing.assert_allclose(off, 0.0, atol=0.05)
        apart = SE2().local(online.mean[-1], batch.values.rows["x"][-1])
        np.testing.assert_allclose(apart / scale, 0.0, atol=0.05)


def test_marginals_are_the_inverse_of_everything(rng):
    """Against the dense inverse of the whole information matrix."""
    from factorlab.graph.slam.rows import Rows

    problem = loop(rng, steps=12, landmarks=4)[0]
    run = BatchSlam().solve(problem)
    rows = Rows(problem, dict(run.values.index))
    matrix = rows.linearise(run.values)[0].toarray()
    dense = np.linalg.inv(matrix.T @ matrix)
    for kind, covs in run.covs.items():
        for n, cov in enumerate(covs):
            span = rows.column(kind, n)
            np.testing.assert_allclose(cov, dense[span, span], rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("loss", [Loss("huber", 1.345), Loss("cauchy", 1.0)], ids=lambda loss: loss.kind)
@pytest.mark.parametrize("route", ["native", "batched"])
def test_a_robust_loss_bears_wild_readings(loss, route, rng):
    problem, pose, _ = loop(rng)
    group = problem.factors[2]
    z = np.array(group.z)
    wild = rng.choice(len(z), len(z) // 10, replace=False)
    z[wild, 0] += rng.uniform(2.0, 6.0, len(wild))
    spoilt = replace(problem, factors=(*problem.factors[:2], replace(group, z=z)))
    begin = BatchSlam().solve(problem).values

    def error(**settings):
        run = BatchSlam(route=route, initial=begin, check=False, **settings).solve(spoilt)
        return np.sqrt(np.square(run.values.rows["x"][:, :2] - pose[:, :2]).sum(axis=1).mean())

    assert error(loss=loss) < 0.5 * error()


@pytest.mark.parametrize("route", ["native", "batched"])
def test_a_prior_is_never_doubted(route):
    """Two opinions on one pose: the prior stands where it is, and the other is taken for an outlier."""
    pose = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    factors = (
        Factors(Prior(SE2()), ("x",), [[0], [1]], pose, 1e-4),
        Factors(Between(SE2()), ("x", "x"), [[0, 1]], [[1.0, 0.0, 0.0]], 1e-2),
    )
    run = BatchSlam(route=route, loss=Loss("huber", 1.0)).solve(SlamProblem({"x": SE2()}, factors))
    np.testing.assert_allclose(run.values.rows["x"], pose, atol=0.01)


@pytest.mark.parametrize("loss", [Loss("huber", 1.345), Loss("cauchy", 1.0)], ids=lambda loss: loss.kind)
def test_losses_agree_on_both_routes(loss, rng):
    problem = pose_graph(rng, SE2())[0]
    native = BatchSlam(route="native", loss=loss).solve(problem)
    batched = BatchSlam(route="batched", loss=loss).solve(problem)
    assert native.report.cost == pytest.approx(batched.report.cost, rel=1e-6)


def test_the_batch_is_as_sure_as_it_should_be(seeds):
    """Mean NEES of the last pose and of the landmarks, by degree of freedom; band of 99.9 % for 20 seeds."""
    poses, places = [], []
    for seed in list(seeds)[:40]:
        problem, pose, place = loop(np.random.default_rng(seed), steps=40, landmarks=8)
        run = BatchSlam().solve(problem)
        error = SE2().local(run.values.rows["x"][-1], pose[-1])
        poses.append(error @ np.linalg.solve(run.covs["x"][-1], error) / 3)
        apart = run.values.rows["l"] - place[run.values.index["l"]]
        places.append(np.einsum("ni,nij,nj->n", apart, np.linalg.inv(run.covs["l"]), apart).mean() / 2)
    assert 0.5 < np.mean(poses) < 1.7
    assert 0.4 < np.mean(places) < 1.9


ESTIMATORS = [BatchSlam(), IncrementalSlam(), FixedLagSlam(100)]


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda estimator: estimator.name)
@pytest.mark.parametrize("model", [LandmarkBearing(), LandmarkRange()], ids=str)
def test_landmarks_wait_for_several_readings(estimator, model, rng):
    """A bearing alone, or a range, places no landmark; a few of them do."""
    problem, pose, place = loop(rng)
    group = problem.factors[2]
    index = np.asarray(group.index)
    sigma = 0.02
    z = model.expected(pose[index[:, 0]], place[index[:, 1]]) + sigma * rng.standard_normal((len(index), 1))
    seen = Factors(model, ("x", "l"), index, z, sigma**2, name="readings")
    run = estimator.solve(replace(problem, factors=(*problem.factors[:2], seen)))
    near = np.linalg.norm(run.values.rows["l"] - place[run.values.index["l"]], axis=1)
    assert np.median(near) < 0.3


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda estimator: estimator.name)
def test_points_are_triangulated_on_the_way(estimator, rng):
    camera = Camera("pinhole", (400.0, 400.0, 320.0, 240.0))
    model = Projection(camera)
    pose = np.zeros((12, 7))
    pose[:, 0], pose[:, 4] = 1.0, 0.25 * np.arange(12)
    point = np.stack([rng.uniform(0, 3, 15), rng.uniform(-1, 1, 15), rng.uniform(4, 7, 15)], axis=1)
    pairs = np.stack(np.meshgrid(np.arange(12), np.arange(15), indexing="ij"), -1).reshape(-1, 2)
    z = model.expected(pose[pairs[:, 0]], point[pairs[:, 1]]) + 0.5 * rng.standard_normal((len(pairs), 2))
    chain = np.stack([np.arange(11), np.arange(1, 12)], axis=1)
    moved = SE3().retract(np.tile([1.0, 0, 0, 0, 0.25, 0, 0], (11, 1)), 0.005 * rng.standard_normal((11, 6)))
    factors = (
        Factors(Prior(SE3()), ("x",), [[0]], pose[:1], 1e-6),
        Factors(Between(SE3()), ("x", "x"), chain, moved, 0.005**2),
        Factors(model, ("x", "l"), pairs, z, 0.25, name="pixels"),
    )
    run = estimator.solve(SlamProblem({"x": SE3(), "l": Vector(3)}, factors))
    assert np.median(np.linalg.norm(run.values.rows["l"] - point, axis=1)) < 0.15


@pytest.mark.parametrize("manifold", [SO2(), SO3(), Vector(3), Vector(5)], ids=str)
def test_chains_of_other_kinds(manifold, rng):
    """Every estimator on rotations and plain vectors."""
    problem, _ = pose_graph(rng, manifold, count=15, closures=10)
    batch = BatchSlam(route="batched").solve(problem)
    for estimator in (BatchSlam(route="native"), IncrementalSlam(threshold=1e-6)):
        run = estimator.solve(problem)
        apart = manifold.local(batch.values.rows["x"], run.values.rows["x"])
        np.testing.assert_allclose(apart, 0.0, atol=1e-5)


def test_a_sensor_of_a_state_space_is_a_factor(rng):
    """GPS positions on poses of a graph, through the sensor that filters use: native elsewhere, rows here."""
    problem, pose = pose_graph(rng, SE3())
    sensor = Position(0.05**2 * np.eye(3), axes=3, lever_arm=(0.3, 0.0, 0.1))
    model = OfSensor(sensor, SE3())
    some = np.arange(0, len(pose), 4)
    z = model.expected(pose[some]) + 0.05 * rng.standard_normal((len(some), 3))
    gps = Factors(model, ("x",), some[:, None], z, sensor.noise_cov, name="gps")
    tied = replace(problem, factors=(*problem.factors, gps))
    batch, online = BatchSlam().solve(tied), IncrementalSlam(threshold=1e-6).solve(tied)
    np.testing.assert_allclose(SE3().local(batch.values.rows["x"], online.values.rows["x"]), 0.0, atol=1e-5)
    before = BatchSlam().solve(problem)
    assert np.trace(batch.covs["x"][-1]) < np.trace(before.covs["x"][-1])


def test_one_lag_by_steps_and_by_seconds(rng):
    problem = loop(rng)[0]
    timed = replace(problem, t=(np.arange(61) * 500_000_000).astype(np.int64))
    steps, seconds = FixedLagSlam(12).solve(timed), FixedLagSlam(6.0, seconds=True).solve(timed)
    # a pose on the very edge of the window may fall to either side of it
    np.testing.assert_allclose(steps.online.mean, seconds.online.mean, atol=1e-2)
    np.testing.assert_array_equal(steps.online.t, timed.t)


def test_a_longer_lag_is_worth_something(seeds):
    """Mean error of the poses as they leave the window, against the filter's lag of one step."""
    errors = {1: [], 60: []}
    for seed in list(seeds)[:8]:
        problem, pose, _ = loop(np.random.default_rng(seed), noise=2.0)
        for lag, found in errors.items():
            run = FixedLagSlam(lag).solve(problem)
            found.append(np.square(run.values.rows["x"][:, :2] - pose[:, :2]).sum(axis=1).mean())
    assert np.mean(errors[60]) < 0.9 * np.mean(errors[1])
