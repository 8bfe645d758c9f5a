"""Association, alignment, APE and RPE against evo, on real recordings and on synthetic poses."""

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D
from hypothesis import given
from hypothesis import strategies as st

from sequential.errors import DataError, ShapeError
from sequential.evaluate import Trajectory, align, ape, associate, rpe, statistics, umeyama
from sequential.manifold import SE3

RECORDINGS = ["fr2_desk", "V102"]


def as_evo(trajectory):
    return PoseTrajectory3D(trajectory.position, trajectory.quaternion, trajectory.t * 1e-9)


def from_tum(path):
    table = np.loadtxt(path)
    return Trajectory(table[:, 0], table[:, 1:4], np.roll(table[:, 4:], 1, axis=1))


def recording(name, data_dir):
    folder = data_dir / "trajectory"
    if name == "fr2_desk":
        return from_tum(folder / "fr2_desk_groundtruth.txt"), from_tum(folder / "fr2_desk_ORB.txt")
    stamps = np.loadtxt(folder / "V102_groundtruth.csv", delimiter=",", usecols=0, dtype=np.int64)
    poses = np.loadtxt(folder / "V102_groundtruth.csv", delimiter=",", usecols=range(1, 8))
    return Trajectory(stamps, poses[:, :3], poses[:, 3:]), from_tum(folder / "V102.txt")


def wandering(rng, count=200):
    truth, noise = SE3(), 0.02
    poses = [truth.random(rng)]
    for _ in range(count - 1):
        step = np.array([0.05, 0.0, 0.1, 0.3, 0.0, 0.05]) + 0.05 * rng.standard_normal(6)
        poses.append(truth.retract(poses[-1], step))
    true = np.stack(poses)
    seen = truth.retract(true, noise * rng.standard_normal((count, 6)))
    t = np.arange(count) * 100_000_000
    return tuple(Trajectory(t, p[:, 4:], p[:, :4]) for p in (true, seen))


def assert_same_statistics(ours, evos):
    for name, value in ours.items():
        assert value == pytest.approx(float(evos[name]), rel=1e-9, abs=1e-9), name


def assert_agrees_with_evo(reference, estimate):
    pair = as_evo(reference), as_evo(estimate)
    for relation, what in [
        (metrics.PoseRelation.translation_part, "translation"),
        (metrics.PoseRelation.rotation_angle_rad, "rotation"),
    ]:
        oracle = metrics.APE(relation)
        oracle.process_data(pair)
        assert_same_statistics(ape(reference, estimate).statistics(what), oracle.get_all_statistics())
        for delta, unit, every in [(1, "f", False), (10, "f", True), (1.5, "m", False), (1.0, "m", True)]:
            evo_unit = {"f": metrics.Unit.frames, "m": metrics.Unit.meters}[unit]
            oracle = metrics.RPE(relation, delta, evo_unit, all_pairs=every)
            oracle.process_data(pair)
            ours = rpe(reference, estimate, delta, unit, all_pairs=every)
            assert len(ours.translation) == len(oracle.error)
            assert_same_statistics(ours.statistics(what), oracle.get_all_statistics())


@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings_give_evos_numbers(name, data_dir):
    reference, estimate = recording(name, data_dir)
    rows = associate(reference.t, estimate.t, 10_000_000)
    theirs = sync.associate_trajectories(as_evo(reference), as_evo(estimate), max_diff=0.01)
    reference, estimate = reference.select(rows[0][:700]), estimate.select(rows[1][:700])
    assert len(rows[0]) == theirs[0].num_poses
    np.testing.assert_allclose(theirs[0].positions_xyz[:700], reference.position, atol=1e-12)
    np.testing.assert_allclose(theirs[1].positions_xyz[:700], estimate.position, atol=1e-12)
    for method, scale in [("se3", False), ("sim3", True)]:
        evos = as_evo(estimate)
        r, t, s = evos.align(as_evo(reference), correct_scale=scale)
        found = align(reference, estimate, method)
        np.testing.assert_allclose(found.rotation, r, atol=1e-9)
        np.testing.assert_allclose(found.translation, t, atol=1e-9)
        assert found.scale == pytest.approx(s, rel=1e-9)
        moved = found.apply(estimate)
        np.testing.assert_allclose(moved.position, evos.positions_xyz, atol=1e-9)
        oracle = metrics.APE(metrics.PoseRelation.rotation_angle_rad)
        oracle.process_data((as_evo(reference), evos))
        assert_same_statistics(ape(reference, moved).statistics("rotation"), oracle.get_all_statistics())
    assert_agrees_with_evo(reference, found.apply(estimate))


def test_synthetic_poses_give_evos_numbers(rng):
    assert_agrees_with_evo(*wandering(rng))


def test_steps_of_seconds_are_counted_in_nanoseconds(rng):
    reference, estimate = wandering(rng, 101)
    by_time, by_count = rpe(reference, estimate, 1.0, "s"), rpe(reference, estimate, 10, "f")
    np.testing.assert_allclose(by_time.translation, by_count.translation, rtol=1e-12)
    assert np.array_equal(by_time.t, by_count.t)
    every = rpe(reference, estimate, 1.0, "s", all_pairs=True, tolerance=0.01)
    assert np.array_equal(every.rotation, rpe(reference, estimate, 10, "f", all_pairs=True).rotation)


@given(
    st.lists(st.integers(0, 2000), min_size=1, max_size=40),
    st.lists(st.integers(0, 2000), min_size=1, max_size=40),
    st.integers(1, 60),
)
def test_association_is_evos(ref, est, most):
    # Milliseconds, so that evo's floats are exact where it compares them.
    ref, est = np.sort(ref), np.sort(est)
    few, many = (est, ref) if len(est) <= len(ref) else (ref, est)
    theirs = sync.matching_time_indices(few.astype(float), many.astype(float), float(most))
    if not theirs[0]:
        with pytest.raises(DataError, match=r"no stamp of the estimate is within .* check their clocks"):
            associate(ref, est, most)
        return
    ours = associate(ref, est, most)
    rows = (ours[1], ours[0]) if len(est) <= len(ref) else ours
    assert rows[0].tolist() == theirs[0]
    assert np.array_equal(many[rows[1]], many[theirs[1]])  # equal stamps may be taken in another order


@pytest.mark.parametrize("method", ["se3", "sim3", "se2", "first_pose", "first_position"])
def test_alignment_undoes_a_known_move(method, rng):
    reference, _ = wandering(rng)
    if method == "se2":
        reference = Trajectory.planar(reference.t, reference.position[:, :2], np.linspace(0, 3, 200))
    scale = 2.5 if method == "sim3" else 1.0
    turn = {"se2": [0, 0, 0.7], "first_position": [0, 0, 0]}.get(method, [0.3, -0.5, 0.7])
    pose = SE3().retract(SE3().identity(), np.array([*turn, 1.0, -2.0, 0.5]))
    moved = align(
        Trajectory([0], pose[None, 4:], pose[None, :4]),
        Trajectory([0], np.zeros((1, 3)), SE3().identity()[None, :4]),
        "first_pose",
    ).apply(reference)
    moved = Trajectory(moved.t, scale * moved.position, moved.quaternion)
    found = align(reference, moved, method)
    assert found.scale == pytest.approx(1.0 / scale)
    errors = ape(reference, found.apply(moved))
    assert errors.translation.max() < 1e-9
    assert errors.rotation.max() < 1e-9


def test_alignment_says_what_it_cannot_do(rng):
    reference, estimate = wandering(rng, 10)
    line = np.outer(np.arange(10.0), [1.0, 2.0, 3.0])
    with pytest.raises(DataError, match="on one line and do not fix a rotation"):
        umeyama(line, line)
    with pytest.raises(ShapeError, match="the reference has 10, the estimate 9; pair them with associate"):
        align(reference, estimate.select(np.arange(9)))
    with pytest.raises(DataError, match=r"align with .* got 'icp'"):
        align(reference, estimate, "icp")
    bare = Trajectory(reference.t, reference.position)
    with pytest.raises(DataError, match="use 'first_position'"):
        align(bare, estimate, "first_pose")


def test_errors_say_what_they_need(rng):
    reference, estimate = wandering(rng, 10)
    bare = Trajectory(reference.t, reference.position)
    assert ape(bare, estimate).rotation is None
    with pytest.raises(DataError, match="no rotation error"):
        ape(bare, estimate).statistics("rotation")
    with pytest.raises(DataError, match="needs rotations"):
        rpe(bare, estimate)
    with pytest.raises(ShapeError, match="pose by pose: the reference has 10 poses, the estimate 3"):
        ape(reference, estimate.select(np.arange(3)))
    for delta, unit in [(0.5, "f"), (0, "m"), (1, "km")]:
        with pytest.raises(DataError, match="a step is a whole number of poses"):
            rpe(reference, estimate, delta, unit)
    with pytest.raises(DataError, match="no two of the 10 poses are 1000 'm' apart"):
        rpe(reference, estimate, 1000.0, "m")


def test_statistics_are_evos():
    values = np.array([3.0, 1.0, 2.0, 4.0])
    oracle = metrics.APE()
    oracle.error = values
    assert_same_statistics(statistics(values), oracle.get_all_statistics())
