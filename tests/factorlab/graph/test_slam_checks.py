"""Bad input and hopeless graphs end in a sentence that names the variable and the measurement."""

from dataclasses import replace

import numpy as np
import pytest
from graph_slam_worlds import loop, pose_graph

from factorlab.graph.slam import BatchSlam, FixedLagSlam, IncrementalSlam
from sequential.errors import DataError, ModelError, NotConvergedError, UnderConstrainedError
from sequential.manifold import SE2, SE3, Vector
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import Between, LandmarkBearing, LandmarkRange, LandmarkRangeBearing, Prior

ESTIMATORS = [BatchSlam(), BatchSlam(route="batched"), IncrementalSlam(), FixedLagSlam(10)]
every_estimator = pytest.mark.parametrize("estimator", ESTIMATORS, ids=["native", "batched", "isam2", "lag"])


def with_factors(problem, *more):
    return replace(problem, factors=(*problem.factors, *more))


@every_estimator
def test_a_loop_closure_to_a_missing_pose_is_named(estimator, rng):
    problem, pose = pose_graph(rng, SE2())
    closure = Factors(Between(SE2()), ("x", "x"), [[3, 9], [5, 999]], pose[:2], 0.01, name="loop closures")
    with pytest.raises(DataError, match=r"measurement 1 of loop closures joins x5 and x999.*x999 is not"):
        estimator.solve(with_factors(problem, closure))


def test_a_pose_that_the_start_lacks_is_named(rng):
    problem, pose = pose_graph(rng, SE2())
    start = Values({"x": np.arange(len(pose) - 1)}, {"x": pose[:-1].copy()})
    with pytest.raises(DataError, match=f"no value for x{len(pose) - 1}"):
        BatchSlam(initial="given").solve(replace(problem, start=start))


@every_estimator
@pytest.mark.parametrize("manifold", [SE2(), SE3(), Vector(2)], ids=str)
def test_a_graph_without_a_frame_is_refused(estimator, manifold, rng):
    problem, _ = pose_graph(rng, manifold)
    with pytest.raises(UnderConstrainedError, match=r"nothing ties x0 and the 39 variables.*add a prior"):
        estimator.solve(replace(problem, factors=problem.factors[1:]))


@every_estimator
def test_a_piece_without_a_frame_is_named(estimator, rng):
    problem, pose = pose_graph(rng, SE2())
    lost = Factors(Between(SE2()), ("x", "x"), [[40, 41]], pose[:1], 0.01)
    with pytest.raises(UnderConstrainedError, match="nothing ties x40 and the 1 variables"):
        estimator.solve(with_factors(problem, lost))


@every_estimator
@pytest.mark.parametrize("model", [LandmarkBearing(), LandmarkRange()])
def test_a_landmark_read_too_little_is_named(estimator, model, rng):
    problem, _, _ = loop(rng)
    once = Factors(model, ("x", "l"), [[4, 77]], [[1.0]], 0.01, name="once")
    with pytest.raises(UnderConstrainedError, match=r"l77 .the landmark. has 2 directions and only 1"):
        estimator.solve(with_factors(problem, once))


@pytest.mark.parametrize("estimator", ESTIMATORS[:3], ids=["native", "batched", "isam2"])
def test_a_landmark_in_line_with_its_bearings_is_named(estimator, rng):
    """Two bearings along one line: rows enough, rank too small."""
    problem, _, _ = loop(rng)
    twice = Factors(LandmarkBearing(), ("x", "l"), [[0, 77], [0, 77]], [[0.3], [0.3]], 0.01, name="twice")
    with pytest.raises(UnderConstrainedError, match="l77"):
        estimator.solve(with_factors(problem, twice))
    # a window lets such readings go with their poses
    run = FixedLagSlam(10).solve(with_factors(problem, twice))
    assert 77 not in run.values.index["l"]
    assert run.report.rejected == 2


@every_estimator
def test_readings_without_ids_are_refused(estimator, rng):
    problem, _, _ = loop(rng)
    group = problem.factors[2]
    nameless = replace(problem, factors=(*problem.factors[:2], replace(group, unknown=1)))
    with pytest.raises(ModelError, match="sightings came without ids"):
        estimator.solve(nameless)


def test_a_landmark_given_but_free_is_named(rng):
    """The rows are enough, and the start is there; what is missing is parallax."""
    problem, _, _ = loop(rng)
    twice = Factors(LandmarkBearing(), ("x", "l"), [[0, 77], [0, 77]], [[0.3], [0.3]], 0.01, name="twice")
    start = Values({"l": np.array([77])}, {"l": np.array([[9.0, 1.0]])})
    problem = replace(with_factors(problem, twice), start=start)
    for estimator in (BatchSlam(), BatchSlam(route="batched"), BatchSlam(method="levenberg_marquardt")):
        with pytest.raises(UnderConstrainedError, match=r"l77 .the landmark."):
            estimator.solve(problem)


def test_a_solver_that_is_stopped_says_so(rng):
    problem, _, _ = loop(rng, noise=3.0)
    for route in ("native", "batched"):
        with pytest.raises(NotConvergedError, match="raise max_iterations"):
            BatchSlam(route=route, max_iterations=1).solve(problem)
        run = BatchSlam(route=route, max_iterations=1, check=False).solve(problem)
        assert not run.report.converged


def test_a_wrong_name_is_refused():
    with pytest.raises(ModelError, match="method is one of"):
        BatchSlam(method="newton")
    with pytest.raises(ModelError, match="route is one of"):
        BatchSlam(route="slow")
    with pytest.raises(ModelError, match="lag"):
        FixedLagSlam(0)


def test_an_unknown_beginning_is_refused(rng):
    problem, _, _ = loop(rng)
    with pytest.raises(ModelError, match="initial is one of steps, given"):
        BatchSlam(initial="luck").solve(problem)


def test_a_lag_in_seconds_needs_times(rng):
    problem, _, _ = loop(rng)
    with pytest.raises(ModelError, match="give the problem its t"):
        FixedLagSlam(2.0, seconds=True).solve(problem)


def test_a_closure_to_a_pose_that_left_is_counted(rng):
    problem, _ = pose_graph(rng, SE2())
    ends = np.asarray(problem.factors[2].index)
    run = FixedLagSlam(5).solve(problem)
    assert run.report.rejected == np.count_nonzero(ends[:, 1] - ends[:, 0] > 6) > 0


def test_a_prior_alone_is_its_own_answer():
    problem = SlamProblem({"x": SE2()}, (Factors(Prior(SE2()), ("x",), [[0]], [[1.0, 2.0, 0.3]], 0.01),))
    for estimator in ESTIMATORS:
        np.testing.assert_allclose(estimator.solve(problem).values.rows["x"], [[1.0, 2.0, 0.3]], atol=1e-9)


def test_a_landmark_seen_first_by_the_last_pose_is_placed(rng):
    problem = loop(rng)[0]
    seen = Factors(LandmarkRangeBearing(), ("x", "l"), [[60, 50]], [[2.0, 0.5]], 0.01)
    run = IncrementalSlam().solve(with_factors(problem, seen))
    distance = np.linalg.norm(run.values.at("l", np.array([50]))[0] - run.values.rows["x"][-1, :2])
    assert distance == pytest.approx(2.0, abs=1e-6)
