"""Every solve is checked: what GTSAM complains of, or keeps to itself, becomes a sentence."""

import gtsam
import numpy as np
import pytest
from graph_worlds import PLANAR, inertial
from worlds import LANDMARKS, attitude, constant_velocity, pendulum

import sequential as sq
from factorlab.graph import BatchGraph
from factorlab.graph.batched import ChainGraph
from factorlab.graph.keys import L, X
from factorlab.graph.solve import newton_decrement, optimise, readable
from sequential.errors import ModelError, NotConvergedError, SolverError, UnderConstrainedError

NOISE = gtsam.noiseModel.Isotropic.Sigma(3, 0.1)


def chain_of_poses(count):
    """Poses tied to each other and to nothing else."""
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for k in range(count):
        values.insert(X(k), gtsam.Pose2(k, 0.1 * k, 0.0))
        if k:
            graph.add(gtsam.BetweenFactorPose2(X(k - 1), X(k), gtsam.Pose2(1, 0, 0), NOISE))
    return graph, values


def test_a_graph_without_a_prior_names_the_free_variable(rng):
    graph, values = chain_of_poses(4)
    with pytest.raises(UnderConstrainedError, match=r"leaves x\d \(the pose\) free.*add a prior"):
        optimise(graph, values)
    problem = PLANAR[0]().problem(rng)
    with pytest.raises(UnderConstrainedError, match=r"leaves x\d \(the pose at \d+\.\d{3} s\) free"):
        optimise(graph, values, problem)


def test_an_unseen_landmark_is_named():
    graph, values = chain_of_poses(3)
    graph.add(gtsam.PriorFactorPose2(X(0), gtsam.Pose2(), NOISE))
    graph.add(gtsam.RangeFactor2D(X(1), L(7), 2.0, gtsam.noiseModel.Isotropic.Sigma(1, 0.1)))
    values.insert(L(7), np.array([3.0, 1.0]))
    with pytest.raises(UnderConstrainedError, match=r"leaves l7 \(the landmark\) free"):
        optimise(graph, values)


def test_with_a_prior_it_solves():
    graph, values = chain_of_poses(4)
    graph.add(gtsam.PriorFactorPose2(X(0), gtsam.Pose2(), NOISE))
    solved = optimise(graph, values)
    assert solved.settled
    assert solved.message() == ""
    assert solved.cost == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(solved.values.atPose2(X(3)).translation(), [3.0, 0.0], atol=1e-6)


def test_a_missing_initial_value_is_named():
    graph, values = chain_of_poses(4)
    graph.add(gtsam.PriorFactorPose2(X(0), gtsam.Pose2(), NOISE))
    graph.add(gtsam.BetweenFactorPose2(X(3), X(4), gtsam.Pose2(1, 0, 0), NOISE))
    with pytest.raises(SolverError, match="a factor names x4, which has no initial value"):
        optimise(graph, values)


def far_start():
    """Poses that begin turned round and far away."""
    graph, values = chain_of_poses(4)
    graph.add(gtsam.PriorFactorPose2(X(0), gtsam.Pose2(), NOISE))
    for k in range(4):
        values.update(X(k), gtsam.Pose2(3.0 - k, 2.0, 1.5))
    return graph, values


def test_an_optimiser_that_is_stopped_says_so():
    graph, values = far_start()
    with pytest.raises(NotConvergedError, match=r"stopped after 1 iterations.*raise max_iterations"):
        optimise(graph, values, max_iterations=1)
    unsettled = optimise(graph, values, max_iterations=1, check=False)
    assert not unsettled.settled
    assert "one more step would take off" in unsettled.message()


def bad_prior():
    """A prior that is far from what the readings say, so that one iteration is not enough."""
    world = PLANAR[0]()
    model = world.model
    x, y, heading = model.prior.mean
    prior = sq.Gaussian([x, y, heading + 2.0], sq.diagonal([2.0, 2.0, 2.0]))
    return sq.StateSpace(model.manifold, prior, model.process, model.sensors, "odometry", 0.0), world


def test_a_native_graph_that_is_stopped_says_so(rng):
    model, world = bad_prior()
    problem = sq.prepare(model, world.draw(rng).log)
    with pytest.raises(NotConvergedError, match="stopped after 1 iterations"):
        BatchGraph(route="native", max_iterations=1).solve(problem)
    run = BatchGraph(route="native", max_iterations=1, check=False).solve(problem)
    assert not run.report.converged
    assert "raise max_iterations" in run.report.message


def test_a_chain_that_is_stopped_says_so(rng):
    problem = PLANAR[2]().problem(rng)
    start = sq.RauchTungStriebel().solve(problem).mean
    far = problem.model.manifold.retract(start, 0.5 * rng.standard_normal(start.shape))
    with pytest.raises(NotConvergedError, match="stopped after 1 iterations"):
        ChainGraph(problem).solve(far, 1, 1e-7)
    unsettled = ChainGraph(problem).solve(far, 1, 1e-7, check=False)
    whole = ChainGraph(problem).solve(far, 50, 1e-7)
    assert whole.settled
    assert not unsettled.settled
    assert whole.cost < unsettled.cost


@pytest.mark.parametrize("route", ["native", "batched"])
def test_a_bad_prior_ends_where_it_should(route, rng):
    model, world = bad_prior()
    run = BatchGraph(route=route, max_iterations=200).solve(sq.prepare(model, world.draw(rng).log))
    assert run.report.converged
    assert {"build_s", "solve_s"} <= set(run.report.details)


@pytest.mark.parametrize("route", ["auto", "native", "batched"])
def test_a_certain_move_tells_to_declare_static(route, rng):
    world = PLANAR[0]()
    model = world.model
    certain = sq.StateSpace(
        model.manifold, model.prior, sq.Unicycle(0.0, 0.0, 0.0), model.sensors, "odometry", 0.0
    )
    problem = sq.prepare(certain, world.draw(rng).log)
    with pytest.raises(ModelError, match=r"up to node 1 \(\d\.\d{3} s\) is singular.*declare .* static="):
        BatchGraph(route=route).solve(problem)


@pytest.mark.parametrize("walks", [(0.0, 1e-3), (1e-4, 0.0)])
def test_a_bias_that_neither_walks_nor_is_static(walks, rng):
    world = inertial()
    model = world.model
    process = sq.Strapdown(sq.ImuNoise(2e-3, 2e-2, *walks), model.process.gravity)
    problem = sq.prepare(
        sq.StateSpace(model.manifold, model.prior, process, model.sensors, "imu", 0.0), world.draw(rng).log
    )
    with pytest.raises(ModelError, match="is singular"):
        BatchGraph().solve(problem)


def test_an_undeclared_static_bias_is_told_to_be_declared(rng):
    manifold = sq.Product(pose=sq.SE2(), bias=sq.Vector(1))
    world = PLANAR[1]()
    model = world.model
    walking = sq.StateSpace(
        manifold,
        model.prior,
        model.process,
        {"seen": sq.Range(LANDMARKS, 0.01, bias="bias")},
        "odometry",
        0.0,
    )
    with pytest.raises(ModelError, match=r"static="):
        BatchGraph().solve(sq.prepare(walking, world.draw(rng).log))


def test_routes_have_names():
    with pytest.raises(ModelError, match="route is one of auto, native, batched, got 'fast'"):
        BatchGraph(route="fast")


@pytest.mark.parametrize("make", [pendulum, attitude, constant_velocity])
def test_native_is_refused_where_there_is_none(make, rng):
    with pytest.raises(ModelError, match=r"without a native GTSAM factor; use route='batched'"):
        BatchGraph(route="native").solve(make().problem(rng))


def test_other_complaints_keep_their_text():
    with pytest.raises(SolverError, match="could not solve the graph: out of luck"), readable():
        raise RuntimeError("out of luck")


def test_the_decrement_is_what_a_step_takes_off(rng):
    """On a linear problem the promise is kept to the digit."""
    problem = constant_velocity().problem(rng)
    chain = ChainGraph(problem)
    anywhere = rng.standard_normal((len(problem.t), 4))
    before = chain.linearise(anywhere)
    linear = chain.linear_graph()
    promised = newton_decrement(linear, problem, chain.ordering)
    after = chain.linearise(anywhere + chain.step(linear))
    assert before - after == pytest.approx(promised, rel=1e-9)
