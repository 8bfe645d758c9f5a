"""Graduated non-convexity: false loop closures go, true ones stay, and GTSAM's own optimiser agrees."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from graph_files import BOTH, looped

from factorlab.graph.slam import BatchSlam, GncSlam
from factorlab.graph.slam.gnc import is_doubted
from factorlab.graph.slam.graduated import SCHEDULES, GemanMcClure, TruncatedSquares
from factorlab.graph.slam.reconsider import influence, reconsidered
from factorlab.graph.slam.sparse import solve_rows
from factorlab.graph.slam.variables import insert_values
from factorlab.graph.slam.weighted import Weighted
from sequential.errors import DataError, ModelError
from sequential.manifold import SE2, SE3
from sequential.slam import Factors
from sequential.slam.models import Displacement
from sequential.slam.models.groups import between


def with_false_loops(problem, rng, count):
    """The problem with loop closures between poses that never met."""
    manifold, loop = problem.kinds["x"], problem.factors[-1]
    poses = len(problem.indices("x"))
    pairs = np.array([rng.choice(poses, 2, replace=False) for _ in range(3 * count)])
    pairs = pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 1][:count]
    z = manifold.random(rng, shape=(len(pairs),))
    false = Factors(loop.model, ("x", "x"), pairs, z, loop.noise_cov, name="false")
    return replace(problem, factors=(*problem.factors, false))


def gap(manifold, one, other):
    """Largest difference between the poses of two runs."""
    return np.abs(manifold.local(one.values.rows["x"], other.values.rows["x"])).max()


@pytest.mark.parametrize("manifold", BOTH, ids=["plane", "space"])
@pytest.mark.parametrize("share", [0.3, 0.5])
def test_half_of_the_loops_may_be_false(manifold, share, rng):
    clean, _ = looped(manifold, rng, count=80, loops=40)
    loops = len(clean.factors[-1])
    problem = with_false_loops(clean, rng, round(share / (1 - share) * loops))
    result = GncSlam(confidence=0.9999, covariance=False).solve_weighted(problem)
    assert (result.weights[-1] == 0).all()
    assert all((weights == 1).all() for weights in result.weights[:-1])
    assert result.run.report.rejected == len(result.weights[-1])
    batch = BatchSlam(covariance=False).solve(clean)
    assert gap(manifold, result.run, batch) < 1e-5
    deceived = BatchSlam(covariance=False, check=False, initial="odometry").solve(problem)
    assert gap(manifold, deceived, batch) > 0.3


def test_without_outliers_it_is_the_batch(rng):
    problem, _ = looped(SE2(), rng, count=50)
    result = GncSlam(confidence=0.99999).solve_weighted(problem)
    batch = BatchSlam().solve(problem)
    assert gap(SE2(), result.run, batch) < 1e-7
    np.testing.assert_allclose(result.run.covs["x"], batch.covs["x"], rtol=1e-5, atol=1e-12)
    assert result.run.report.details["chi2"] == pytest.approx(batch.report.details["chi2"], rel=1e-9)
    assert result.run.report.rejected == 0
    assert all((weights == 1).all() for weights in result.weights)


def test_one_false_loop_that_bent_the_odometry_is_found_afterwards(rng):
    """Begun where a false loop is believed: no residual tells it, its influence does."""
    clean, _ = looped(SE2(), rng, count=80, loops=40)
    far = np.array([[3, 70]])
    loop = clean.factors[-1]
    z = between(SE2(), *(BatchSlam(covariance=False).solve(clean).values.at("x", end) for end in far.T))
    false = Factors(
        loop.model, ("x", "x"), far, SE2().retract(z, np.array([[1.0, -0.9, 0.4]])), loop.noise_cov
    )
    problem = replace(clean, factors=(*clean.factors, false))
    index = {"x": problem.indices("x")}
    rows = Weighted(problem, index, [is_doubted(problem, group) for group in problem.factors], 0.9999)
    rows.weigh(np.ones(rows.count))
    deceived = solve_rows(rows.rows, BatchSlam(covariance=False).solve(problem).values, 50).values
    which = np.array([rows.count - 1])
    told = influence(rows, deceived, which)[0]
    rows.weigh(np.r_[np.ones(rows.count - 1), 0.0])
    without = solve_rows(rows.rows, deceived, 50).values
    freed = 2.0 * BatchSlam(covariance=False).solve(problem).report.cost - 2.0 * rows.rows.cost(without)
    assert told == pytest.approx(freed, rel=0.2)
    added = influence(rows, without, which)[0]
    assert added == pytest.approx(freed, rel=0.2)
    rows.weigh(np.ones(rows.count))
    found = reconsidered(rows, deceived, SCHEDULES["tls"])
    assert rows.weights_now()[-1] == 0.0
    assert rows.weights_now()[:-1].all()
    np.testing.assert_allclose(SE2().local(without.rows["x"], found.rows["x"]), 0, atol=1e-5)


def test_noise_that_is_stated_far_too_large_hides_no_outlier(rng):
    """As in the Intel graph, whose χ² is a fiftieth of its degrees of freedom."""
    clean, _ = looped(SE2(), rng, count=80, loops=40)
    loose = [g if g.name == "prior" else replace(g, noise_cov=50 * g.noise_cov) for g in clean.factors]
    problem = with_false_loops(replace(clean, factors=tuple(loose)), rng, 15)
    result = GncSlam(covariance=False).solve_weighted(problem)
    assert (result.weights[-1] == 0).all()
    assert all((weights == 1).all() for weights in result.weights[:-1])


def test_covariance_is_that_of_what_was_believed(rng):
    clean, _ = looped(SE2(), rng, count=40)
    result = GncSlam(confidence=0.9999).solve_weighted(with_false_loops(clean, rng, 10))
    np.testing.assert_allclose(
        result.run.covs["x"], BatchSlam().solve(clean).covs["x"], rtol=1e-3, atol=1e-10
    )


def test_a_start_is_tried_beside_the_trusted_one(rng):
    """Odometry so bad that its own start rejects true loops; the relaxation keeps them."""
    problem, _ = looped(SE2(), rng, count=60, loops=80, sigma=0.3)
    alone = GncSlam(covariance=False, confidence=0.9999, initial="trusted").solve(problem)
    beside = GncSlam(covariance=False, confidence=0.9999).solve(problem)
    assert beside.report.details["robust_cost"] <= alone.report.details["robust_cost"] * (1 + 1e-9)


@pytest.mark.parametrize("loss", ["tls", "gm"])
def test_gtsams_optimiser_comes_to_the_same(loss, rng):
    clean, _ = looped(SE2(), rng, count=40, loops=30)
    problem = with_false_loops(clean, rng, 8)
    ours = GncSlam(loss=loss, covariance=False, reconsider=False, initial="trusted").solve_weighted(problem)
    graph, trusted = gtsam.NonlinearFactorGraph(), []
    for group in problem.factors:
        for row in range(len(group)):
            if group.name in {"prior", "odometry"}:
                trusted.append(graph.size())
            noise = gtsam.noiseModel.Gaussian.Covariance(group.covs()[row])
            keys = [gtsam.symbol("x", int(k)) for k in group.index[row]]
            make = gtsam.PriorFactorPose2 if len(keys) == 1 else gtsam.BetweenFactorPose2
            graph.add(make(*keys, gtsam.Pose2(*group.z[row]), noise))
    parameters = gtsam.GncLMParams()
    kind = gtsam.GncLossType.TLS if loss == "tls" else gtsam.GncLossType.GM
    parameters.setLossType(kind)
    parameters.setKnownInliers(trusted)
    start = insert_values(problem, BatchSlam(covariance=False).solve(replace_loops(problem)).values)
    optimizer = gtsam.GncLMOptimizer(graph, start, parameters)
    theirs = optimizer.optimize()
    poses = [theirs.atPose2(gtsam.symbol("x", k)) for k in range(40)]
    other = np.array([[p.x(), p.y(), p.theta()] for p in poses])
    bound = 1e-4 if loss == "tls" else 0.02  # Geman-McClure: GTSAM stops one factor before mu = 1
    assert np.abs(SE2().local(ours.run.values.rows["x"], other)).max() < bound
    weights = optimizer.getWeights()
    np.testing.assert_allclose(np.concatenate(ours.weights), weights, atol=1e-6 if loss == "tls" else 0.15)


def replace_loops(problem):
    """The trusted measurements alone."""
    return replace(problem, factors=problem.factors[:2])


def test_sightings_of_landmarks_may_be_doubted(rng):
    problem, truth = looped(SE2(), rng, count=30, loops=0)
    model = Displacement(SE2())
    point = np.array([[3.0, 1.0]])
    index = np.column_stack([np.arange(30), np.zeros(30, dtype=np.int64)])
    z = model.expected(truth, np.tile(point, (30, 1))) + 0.02 * rng.standard_normal((30, 2))
    wrong = np.arange(3, 30, 5)
    z[wrong] += 5.0
    seen = Factors(model, ("x", "l"), index, z, 0.02**2, name="seen")
    whole = replace(problem, kinds={"x": SE2(), "l": model.measured}, factors=(*problem.factors, seen))
    result = GncSlam(doubted=("seen",), confidence=0.9999).solve_weighted(whole)
    assert np.flatnonzero(result.weights[-1] < 0.5).tolist() == wrong.tolist()
    assert np.abs(result.run.values.rows["l"] - point).max() < 0.1


@pytest.mark.parametrize("schedule", SCHEDULES.values(), ids=SCHEDULES)
def test_weights_fall_with_the_residual(schedule):
    squared = np.linspace(0.0, 200.0, 500)
    bound = np.full(500, 11.3)
    mu = schedule.first(squared, bound)
    before = None
    for _ in range(60):
        weights = schedule.weights(squared, bound, mu)
        assert weights[0] == 1.0
        assert (np.diff(weights) <= 1e-15).all()
        assert weights.min() >= 0.0
        mu, before = schedule.next(mu), weights
    assert schedule.first(squared[:20], bound[:20]) is None
    if isinstance(schedule, TruncatedSquares):
        np.testing.assert_array_equal(
            before[np.abs(squared - 11.3) > 0.2], (squared < 11.3)[np.abs(squared - 11.3) > 0.2]
        )
    elif isinstance(schedule, GemanMcClure):
        np.testing.assert_allclose(before, (11.3 / (11.3 + squared)) ** 2)


@pytest.mark.parametrize("schedule", SCHEDULES.values(), ids=SCHEDULES)
def test_a_weight_is_the_slope_of_the_cost(schedule):
    """Iteratively reweighted least squares minimises what `cost` says: w = dρ/d(r²)."""
    bound = np.array([7.8])
    for squared in (0.3, 5.0, 7.0, 9.0, 40.0):
        at, h = np.array([squared]), 1e-5
        slope = (schedule.cost(at + h, bound) - schedule.cost(at - h, bound)) / (2 * h)
        mu = 1e9 if isinstance(schedule, TruncatedSquares) else 1.0
        assert schedule.weights(at, bound, mu)[0] == pytest.approx(slope, abs=1e-7)


def test_what_cannot_be_is_said(rng):
    problem, _ = looped(SE3(), rng, count=8, loops=6)
    with pytest.raises(ModelError, match="loss is one of tls, gm, dcs"):
        GncSlam(loss="huber")
    with pytest.raises(ModelError, match="between 0 and 1"):
        GncSlam(confidence=1.0)
    with pytest.raises(
        DataError, match="no group of the problem is called 'loops'; there are prior, odometry"
    ):
        GncSlam(doubted=("loops",)).solve(problem)
