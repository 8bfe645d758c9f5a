"""What readings cannot show: worlds whose open directions are known, and recordings."""

import math
from dataclasses import replace

import numpy as np
import pytest
from linear_processes import declare
from worlds import (
    EVERY_WORLD,
    LANDMARKS,
    LINEAR_WORLDS,
    floating_pose,
    strapdown,
    unicycle_range_bearing,
    without_jacobians,
)

import sequential as sq
from sequential.errors import DataError, ModelError
from sequential.evaluate import observability

CV = sq.ConstantVelocity(0.1)


def still_log(model, count=30, dt=0.5, **more):
    """A log of the model's own; what is read does not matter to a linear model."""
    return sq.simulate(model, np.arange(count) * dt, np.random.default_rng(2), **more).log


def one_landmark(sensor):
    world = unicycle_range_bearing()
    model = sq.StateSpace(
        sq.SE2(), world.model.prior, world.model.process, {"beacon": sensor}, "odometry", 0.0
    )
    settings = {"inputs": world.inputs, "readings": {"beacon": 5}, "contexts": {"beacon": [2.0]}}
    return model, sq.simulate(model, world.t, np.random.default_rng(5), **settings).log


SENSORS = {
    "range": sq.Range(LANDMARKS, 0.1**2),
    "range and bearing": sq.RangeBearing(LANDMARKS, sq.diagonal([0.1, 0.03])),
}


@pytest.mark.parametrize("sensor", SENSORS.values(), ids=SENSORS)
@pytest.mark.parametrize("about", ["the prior", "an estimate"])
def test_one_landmark_leaves_the_turn_about_it(sensor, about):
    """Also about an estimate, whose jumps must not be taken for information."""
    model, log = one_landmark(sensor)
    run = None if about == "the prior" else sq.run(sq.IteratedSmoother(), model, log)
    found = observability(model, log, run)
    assert (found.rank, found.dim, found.observable) == (2, 3, False)
    (only,) = found.unobservable
    assert only.words == "the pose turns about landmark 2 of 'beacon', heading and position together"
    assert only.information == 0.0
    assert found.information[-1] == 0.0 < found.information[-2]


@pytest.mark.parametrize("name", SENSORS)
def test_a_second_landmark_settles_it(name):
    model, log = one_landmark(SENSORS[name])
    beacon = log["beacon"]
    context = np.where(np.arange(len(beacon)) % 2, 2.0, 0.0)[:, None]
    both = log.replaced(beacon=sq.Stream(beacon.t, beacon.values, context))
    assert observability(model, both).observable


def test_a_turn_about_no_landmark_is_given_its_centre():
    """A user's range sensor to a point that nobody declared as a landmark."""
    centre = np.array([4.0, -3.0])
    world = unicycle_range_bearing()
    sensor = sq.Sensor(lambda x: [math.hypot(x[0] - 4.0, x[1] + 3.0)], 0.01)
    model = sq.StateSpace(sq.SE2(), world.model.prior, world.model.process, {"mast": sensor}, "odometry", 0.0)
    log = sq.simulate(model, world.t, np.random.default_rng(1), inputs=world.inputs).log
    (only,) = observability(model, log).unobservable
    assert only.words.startswith(f"the pose turns about ({centre[0]:.3g}, {centre[1]:.3g}): ")


def flight(push=0.0, turn=0.0, yaw=0.7):
    """Level flight with biases that are known exactly, so that it is straight and steady unless pushed."""
    noise = sq.ImuNoise(2e-3, 2e-2, 1e-4, 1e-3)
    nav = [math.cos(yaw / 2), 0, 0, math.sin(yaw / 2), 1, 2, 0.5, 2.0, 0.5, 0]
    mean = sq.inertial_state().pack(nav=nav, accel_bias=np.zeros(3), gyro_bias=np.zeros(3))
    sigmas = [*[0.03] * 3, *[0.5] * 3, *[0.3] * 3, *[0.05] * 3, *[0.01] * 3]
    model = sq.StateSpace(
        sq.inertial_state(), sq.Gaussian(mean, sq.diagonal(sigmas)), sq.Strapdown(noise),
        {"gps": sq.Position(0.04)}, "imu", 0.0,
    )  # fmt: skip
    k = np.arange(401)
    still = 0.0 * k
    imu = np.column_stack(
        [push * np.sin(0.05 * k), still, 9.81 + still, still, still, turn * np.cos(0.03 * k)]
    )
    return model, sq.simulate(model, k * 0.02, np.random.default_rng(0), inputs=imu, readings={"gps": 10}).log


def test_steady_flight_hides_the_heading():
    """GPS and IMU: heading, the gyro's bias about the vertical, each tilt against an accelerometer bias."""
    found = observability(*flight())
    assert found.rank == 11
    words = [one.words for one in found.unobservable]
    assert words[:2] == ["heading of nav: it turns about the vertical", "gyro_bias.x2"]
    for one, (tilt, bias, sign) in zip(found.unobservable[2:], ((1, 9, 1.0), (0, 10, -1.0)), strict=True):
        # a bias of g·angle looks like the tilt
        expected = np.zeros(15)
        expected[tilt], expected[bias] = sign, 9.81
        np.testing.assert_allclose(one.vector / one.vector[tilt] * sign, expected, atol=1e-6)


def test_a_manoeuvre_shows_what_steady_flight_hides():
    assert observability(*flight(push=1.0)).rank == 14
    found = observability(*flight(push=1.0, turn=1.0))
    assert found.observable
    assert found.weak  # for seconds of gentle motion the readings say less of biases than the prior does
    assert all(0.0 < one.information < 1.0 for one in found.weak)


def test_what_an_antenna_and_a_mast_leave():
    """Two points of a body: the turn about the line through them."""
    world = floating_pose()
    (only,) = observability(world.model, world.draw(np.random.default_rng(0)).log).unobservable
    arm = np.array([1.0, 0.5, -0.5])
    np.testing.assert_allclose(np.cross(only.vector[:3] / np.linalg.norm(only.vector[:3]), arm), 0, atol=1e-6)
    np.testing.assert_allclose(only.vector[3:], 0.0, atol=1e-9)


def biased(rows):
    state = sq.Product(motion=sq.Vector(2), bias=sq.Vector(1))
    process = sq.Independent(motion=CV, bias=sq.RandomWalk(0.01))
    sensors = {f"s{k}": sq.LinearSensor([row], 0.1) for k, row in enumerate(rows)}
    return declare(process, state, sensors)


def test_two_sensors_with_the_same_bias():
    model = biased([[1, 0, 1], [1, 0, 1]])
    found = observability(model, still_log(model))
    (only,) = found.unobservable
    assert only.words == "0.71 motion.x0 - 0.71 bias.x0 (in standard deviations of the prior)"
    model = biased([[1, 0, 1], [1, 0, 0]])
    assert observability(model, still_log(model)).observable


def test_a_clock_offset_needs_beacons_on_both_sides():
    """Times of flight along a line, all late by the same clock."""
    left, right = [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]
    model = biased([left])
    (only,) = observability(model, still_log(model)).unobservable
    assert "motion.x0" in only.words
    assert "bias.x0" in only.words
    model = biased([left, right])
    assert observability(model, still_log(model)).observable


def test_a_position_is_never_seen_by_a_speedometer():
    model = declare(CV, sq.Vector(2), {"speed": sq.LinearSensor([[0.0, 1.0]], 0.1)})
    found = observability(model, still_log(model))
    assert [one.words for one in found.unobservable] == ["x0"]
    assert str(found) == "1 of 2 directions show in the readings\nnever seen: x0"
    np.testing.assert_allclose(found.reduction[0], 1.0)


@pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)
def test_the_gramian_is_the_information_of_a_filter_without_noise(world, rng):
    """What a Kalman filter knows of the start, with a process that adds nothing."""
    log = world.draw(rng).log
    found = observability(world.model, log)
    change = (
        {"density": 0.0} if isinstance(world.model.process, sq.RandomWalk) else {"acceleration_density": 0.0}
    )
    quiet = replace(world.model, process=replace(world.model.process, **change))
    run = sq.run(sq.KalmanFilter(), quiet, log)
    flow = np.eye(world.model.manifold.dim)
    if isinstance(world.model.process, sq.ConstantVelocity):
        flow[:2, 2:] = np.eye(2) * (run.t[-1] - run.t[0]) * 1e-9
    posterior = np.linalg.inv(found.gramian + np.linalg.inv(world.model.prior.cov))
    np.testing.assert_allclose(flow @ posterior @ flow.T, run.cov[-1], rtol=1e-6)
    scale = np.sqrt(np.diag(posterior) / np.diag(world.model.prior.cov))
    np.testing.assert_allclose(found.reduction, scale, rtol=1e-9)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
@pytest.mark.parametrize("rows", [[[1.0, 0, 1]], [[1.0, 0, 0], [1.0, 0, 1]]])
def test_units_change_nothing(rows, factor):
    """The bias in micrometres: same rank, same information."""
    model = biased(rows)
    log = still_log(model)
    found = observability(model, log)
    units = np.array([1.0, 1.0, factor])
    scaled = declare(
        sq.Independent(motion=CV, bias=sq.RandomWalk(0.01 * factor**2)),
        model.manifold,
        {f"s{k}": sq.LinearSensor([np.array(row) / units], 0.1) for k, row in enumerate(rows)},
        np.diag(units**2),
    )
    other = observability(scaled, log)
    assert other.rank == found.rank
    np.testing.assert_allclose(other.information, found.information, rtol=1e-9)
    np.testing.assert_allclose(other.reduction, found.reduction, rtol=1e-9)
    assert [one.words for one in other.unobservable] == [one.words for one in found.unobservable]


@pytest.mark.parametrize("width", [1e-3, 1e3])
def test_the_prior_does_not_decide_the_rank(width):
    model, log = flight()
    other = replace(model, prior=sq.Gaussian(model.prior.mean, width**2 * model.prior.cov))
    assert observability(other, log).rank == 11


@pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
def test_differenced_jacobians_find_the_same(world, rng):
    log = world.draw(rng).log
    one, other = observability(world.model, log), observability(without_jacobians(world.model), log)
    assert one.rank == other.rank
    np.testing.assert_allclose(other.information, one.information, rtol=1e-3, atol=1e-6 * one.information[0])


def test_a_part_of_a_log_needs_a_run():
    world = strapdown()
    log = world.draw(np.random.default_rng(1)).log
    with pytest.raises(ModelError, match="between=… needs a run that says where the state was then"):
        observability(world.model, log, between=(1.0, 2.0))
    run = sq.run(sq.IteratedSmoother(), world.model, log)
    found = observability(world.model, log, run, between=(1.0, 2.0))
    assert found.t == 10**9
    assert found.information[0] < observability(world.model, log, run).information[0]
    with pytest.raises(DataError, match=r"there are 0 moments with readings between 90\.0 s and 99\.0 s"):
        observability(world.model, log, run, between=(90.0, 99.0))


class TestRecordings:
    def test_the_whole_drive_shows_everything(self):
        from factorlab.datasets import load

        (kitti,) = load("kitti")
        found = observability(kitti.model, kitti.log)
        assert found.observable
        assert not found.weak

    def test_half_a_minute_of_driving_does_not_show_the_gyro_s_bias(self):
        """KITTI's prior knows it to 5e-5 rad/s; 30 s of fixes say less than that."""
        from factorlab.datasets import load

        (kitti,) = load("kitti")
        run = sq.run(sq.IteratedSmoother(leave_one_out=False), kitti.model, kitti.log)
        begin = run.t[0] * 1e-9
        found = observability(kitti.model, kitti.log, run, between=(begin + 60, begin + 90))
        assert found.observable
        assert {"gyro_bias" in one.words for one in found.weak} == {True}

    @pytest.mark.parametrize("name", ["plaza1", "plaza2"])
    def test_ranges_to_one_beacon_of_four(self, name):
        """All four show pose, offset and scale of the radios; one leaves the turn about itself."""
        from factorlab.datasets import load

        (plaza,) = load(name)
        assert observability(plaza.model, plaza.log).observable
        ranges = plaza.log["range"]
        alone = plaza.log.replaced(range=ranges.select(ranges.context[:, 0] == 1))
        (only,) = observability(plaza.model, alone).unobservable
        assert only.words == "pose turns about landmark 1 of 'range', heading and position together"
