"""Native factors of sensors on a body in space are our rows, and both routes solve one problem.

A reading that is a rotation or a pose has the same cost; GTSAM differentiates its logarithm at the residual,
our rows at zero.
"""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from graph_rows import anywhere, assert_same_system, native_system, our_system
from graph_worlds import planar
from sensor_worlds import BODY_T_CAMERA, FIELD, LANDMARKS, MOUNT, TILTED, aided, drifting_camera, imu_inputs
from worlds import times

import sequential as sq
from factorlab.graph import BatchGraph, FixedLagGraph, IncrementalGraph
from factorlab.graph.batch import build
from factorlab.graph.batched import ChainGraph
from factorlab.graph.factors.inertial import InertialGraph, to_world
from factorlab.graph.factors.pose_sensors import Body, pose3, pose_factor
from factorlab.graph.keys import X
from factorlab.graph.native import native_graph
from sequential.model import evaluate

INNER = (500.0, 510.0, 320.0, 240.0)
ROWS = np.arange(8, 201, 8)
SENSORS = {
    "gps": sq.Position([0.04, 0.05, 0.09], lever_arm=(0.5, -0.3, 0.8)),
    "antenna": sq.Position([0.04, 0.05, 0.09], arm="arm"),
    "barometer": sq.Barometer(0.3**2, bias="offset"),
    "gravity": sq.Direction((0.0, 0.0, 9.81), 0.4**2),
    "compass": sq.Magnetometer(FIELD, [0.2, 0.3, 0.4], body_q_sensor=TILTED),
    "doppler": sq.Velocity([0.01, 0.02, 0.03]),
    "still": sq.ZeroVelocity(2.0**2),
    "tracker": sq.Orientation([4e-4, 9e-4, 1e-4], body_q_sensor=TILTED),
    "localiser": sq.PoseReading([4e-4, 9e-4, 1e-4, 0.01, 0.02, 0.03], body_T_sensor=MOUNT),
}
CAMERAS = {
    "pixels": sq.CameraProjection(LANDMARKS, [1.0, 2.0], INNER, BODY_T_CAMERA),
    "pair": sq.StereoPixels(LANDMARKS + 1.0, [1.0, 1.5, 2.0], INNER, 0.25, BODY_T_CAMERA, shared_row=True),
    "pose": sq.PoseReading([4e-4, 9e-4, 1e-4, 0.01, 0.02, 0.03], body_T_sensor=MOUNT),
    "tracker": sq.Orientation([4e-4, 9e-4, 1e-4], body_q_sensor=TILTED),
    "gps": sq.Position(0.04, lever_arm=(0.5, -0.3, 0.8)),
}


def flying(names, loss=None):
    """Strapdown navigation with some of the sensors; a bias that walks and a lever arm that does not."""
    world = aided()
    manifold = sq.Product(
        nav=sq.NavState(),
        accel_bias=sq.Vector(3),
        gyro_bias=sq.Vector(3),
        offset=sq.Vector(1),
        arm=sq.Vector(3),
    )
    mean = np.concatenate([world.model.prior.mean[:16], [1.0], [0.4, -0.2, 0.7]])
    sigmas = np.repeat([0.05, 0.5, 0.3, 0.05, 0.01, 2.0, 0.2], [3, 3, 3, 3, 3, 1, 3])
    model = sq.StateSpace(
        manifold, sq.Gaussian(mean, sq.diagonal(sigmas)), world.model.process,
        {name: replace(SENSORS[name], loss=loss) for name in names}, "imu", 0.0, static=("arm",),
    )  # fmt: skip
    return replace(
        world, name=", ".join(names), model=model, t=times(201, 0.02), inputs=imu_inputs(201),
        readings=dict.fromkeys(names, ROWS),
    )  # fmt: skip


def drifting(names):
    """A body that drifts, with some of the cameras."""
    world = drifting_camera()
    model = world.model
    rows = np.arange(2, 61, 2)
    which = {name: (rows % len(LANDMARKS))[:, None] for name in names if name in {"pixels", "pair"}}
    other = sq.StateSpace(
        model.manifold, model.prior, model.process, {name: CAMERAS[name] for name in names}, start=0.0
    )
    return replace(world, model=other, readings=dict.fromkeys(names, rows), contexts=which)


CURVED = {"tracker", "localiser", "pose"}


@pytest.mark.parametrize("loss", [None, sq.Loss("huber", 1.0)], ids=["squares", "huber"])
@pytest.mark.parametrize("name", [name for name in SENSORS if name not in CURVED])
def test_factors_on_a_navigation_state_are_our_rows(name, loss, rng):
    problem = flying([name], loss).problem(rng)
    native, chain = native_graph(problem), ChainGraph(problem)
    assert isinstance(native, InertialGraph)
    d = problem.model.manifold.dim
    for _ in range(5):  # times 25 nodes
        trajectory = anywhere(problem, rng, 0.2)
        chain.linearise(trajectory)
        _, values = build(native, trajectory)
        for k in range(1, len(trajectory)):
            first, last = chain.rows.first[k : k + 2]
            rows = slice(first + len(chain.moving), last)
            keys = native.reading_factors(k)[0].keys()
            # our columns, with the velocity turned to the world as GTSAM's is
            ours = np.zeros((last - rows.start, d))
            ours[:, chain.moving], ours[:, chain.static] = chain.rows.here[rows], chain.rows.fixed[rows]
            ours = ours @ to_world(trajectory[k], d).T
            spans = {key: s for key, s in zip(native._state_keys(k), SPANS, strict=True) if key in keys}
            columns = np.hstack([ours[:, s] for s in spans.values()])
            theirs = native_system(native.reading_factors(k), values, list(spans))
            assert_same_system(theirs, (columns.T @ columns, columns.T @ chain.rows.right[rows]))


SPANS = (slice(0, 6), slice(6, 9), slice(9, 15), slice(15, 16), slice(16, 19))


@pytest.mark.parametrize("name", ["tracker", "localiser"])
def test_factors_of_rotations_and_poses_are_ours_differentiated_at_the_reading(name, rng):
    sensor, own = SENSORS[name], sq.SE3()
    f, image, weight = sensor.functions(own), sensor.manifold, np.linalg.inv(sensor.noise_cov)
    for _ in range(100):
        x = own.random(rng)
        h = evaluate(f.value, x, np.zeros(1), 0.0, f.params, image.size)
        z = image.retract(h, 0.3 * rng.standard_normal(image.dim))
        jacobian = evaluate(f.jacobian, x, np.zeros(1), 0.0, f.params, image.dim * 6).reshape(-1, 6)
        ahead, error = np.linalg.solve(image.transport(z, h)[1], jacobian), image.local(z, h)
        factor, values = pose_factor(sensor, Body())(0, z, 0), gtsam.Values()
        values.insert(X(0), pose3(x))
        assert factor.error(values) == pytest.approx(0.5 * error @ weight @ error, rel=1e-9)
        theirs = native_system([factor], values, [X(0)])
        assert_same_system(theirs, (ahead.T @ weight @ ahead, -ahead.T @ weight @ error))


@pytest.mark.parametrize("name", [name for name in CAMERAS if name not in CURVED])
def test_factors_on_a_pose_are_our_rows(name, rng):
    problem = drifting([name]).problem(rng)
    native, chain = native_graph(problem), ChainGraph(problem)
    for _ in range(5):  # times 30 nodes
        trajectory = anywhere(problem, rng, 0.1)
        cost = chain.linearise(trajectory)
        graph, values = build(native, trajectory)
        assert graph.error(values) == pytest.approx(cost, rel=1e-9)
        for k in range(1, len(trajectory)):
            rows = slice(chain.rows.first[k] + 6, chain.rows.first[k + 1])
            ours = our_system(chain, rows, chain.rows.here)
            assert_same_system(native_system(native.reading_factors(k), values, native.keys(k)), ours)


def assert_routes_agree(problem, mean, cov):
    native, batched = (
        BatchGraph(route=route, max_iterations=100).solve(problem) for route in ("native", "batched")
    )
    scale = batched.sigmas()
    apart = np.abs(problem.model.manifold.local(batched.mean, native.mean)) / scale
    assert apart.max() < mean
    assert (np.abs(native.cov - batched.cov) / (scale[:, :, None] * scale[:, None, :])).max() < cov
    return native, batched


def test_everything_on_one_body(rng):
    """What is left between the routes is the first-order bias correction of a preintegration."""
    assert_routes_agree(flying(list(SENSORS)).problem(rng), 0.5, 0.05)
    problem = flying([name for name in SENSORS if name not in CURVED]).problem(rng)
    native, _ = assert_routes_agree(problem, 0.05, 0.02)
    assert np.ptp(native.part("arm"), axis=0).max() == 0.0
    assert np.ptp(native.part("offset")) > 0.0


def test_all_cameras_on_one_pose(rng):
    assert_routes_agree(drifting(list(CAMERAS)).problem(rng), 0.1, 0.02)
    plain = [name for name in CAMERAS if name not in CURVED]
    assert_routes_agree(drifting(plain).problem(rng), 1e-4, 1e-4)


def test_incremental_graphs_take_parts_beside(rng):
    problem = flying(["gps", "antenna", "barometer", "compass"]).problem(rng)
    final, batch = IncrementalGraph(final=True).solve(problem), BatchGraph(route="native").solve(problem)
    apart = np.abs(problem.model.manifold.local(batch.mean, final.mean)) / batch.sigmas()
    assert apart.max() < 0.05
    lagged = FixedLagGraph(lag=1e3).solve(problem)
    assert not lagged.report.message
    last = np.abs(problem.model.manifold.local(batch.mean[-1], lagged.mean[-1])) / batch.sigmas()[-1]
    assert last.max() < 0.2


NOT_NATIVE = {
    "a barometer without a bias": {"barometer": sq.Barometer(0.09)},
    "a barometer upside down": {"barometer": sq.Barometer(0.09, bias="offset", up=-1.0)},
    "two modes": {"marker": sq.TwoModeOrientation(1e-3)},
    "wheels": {"wheels": sq.WheelOdometry(0.01)},
    "a gate": {"gps": sq.Position(0.04, gate=0.999)},
    "an arm beside an arm": {"gps": sq.Position(0.04, lever_arm=(1.0, 0, 0), arm="arm")},
}


def changed(world, **what):
    """The world with a model of which some fields are others."""
    model = world.model
    fields = {name: getattr(model, name) for name in ("prior", "process", "sensors", "static")} | what
    return replace(world, model=sq.StateSpace(model.manifold, input="imu", start=0.0, **fields))


@pytest.mark.parametrize("name", NOT_NATIVE)
def test_what_gtsam_lacks_goes_the_batched_way(name, rng):
    world = flying(["gps"])
    sensors = {**world.model.sensors, **NOT_NATIVE[name]}
    contexts = {"marker": np.concatenate([[1.0, 0, 0, 0], np.zeros(20)])}
    other = replace(changed(world, sensors=sensors), readings=dict.fromkeys(sensors, ROWS), contexts=contexts)
    assert native_graph(other.problem(rng)) is None


def test_a_part_that_neither_walks_nor_is_static_is_not_native(rng):
    world = flying(["gps"])
    noise, prior = world.model.process.noise, world.model.prior
    assert native_graph(world.problem(rng)) is not None
    assert native_graph(changed(world, process=sq.Strapdown(noise)).problem(rng)) is None
    cov = np.array(prior.cov)
    cov[15, 3] = cov[3, 15] = 0.1
    assert native_graph(changed(world, prior=sq.Gaussian(prior.mean, cov)).problem(rng)) is None


def test_a_localiser_in_the_plane_is_a_prior(rng):
    """PriorFactorPose2 has the cost of our rows, and the graph's solution is the batched one's."""
    noise = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.001], [0.0, 0.001, 4e-4]])
    sensor = sq.PoseReading(noise, body_T_sensor=[0.3, -0.2, 0.5], planar=True)
    problem = planar(sensor, context=False).problem(rng)
    chain = ChainGraph(problem)
    trajectory = anywhere(problem, rng, 0.2)
    cost = chain.linearise(trajectory)
    graph, values = build(native_graph(problem), trajectory)
    assert graph.error(values) == pytest.approx(cost, rel=1e-9)
    assert_routes_agree(problem, 0.05, 0.02)
