"""What cannot be calibrated is said in a sentence that names what is missing; what is damaged is survived."""

from dataclasses import replace

import numpy as np
import pytest
from cam_imu_worlds import errors, recorded, within

from sequential.errors import DataError, ModelError, UnderConstrainedError
from vision3d.inertial import CamImuSettings


@pytest.fixture(scope="module")
def world():
    return recorded(0)


def test_recordings_of_other_times_are_refused(world):
    later = world.changed(imu=replace(world.imu, t=world.imu.t + 100.0))
    with pytest.raises(DataError, match=r"do not overlap in time.*--clocks apart"):
        later.calibrated()


def test_clocks_that_have_nothing_to_do_with_each_other_are_put_together(world):
    later = world.changed(imu=replace(world.imu, t=world.imu.t + 1000.0))
    found = later.calibrated(common_clock=False)
    assert abs(found.time_offset_s - 1000.0 - world.rig.time_offset_s) < 1e-4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gyro": lambda imu: np.degrees(imu.gyro)}, "degrees a second where radians.*--units gyro=deg/s"),
        ({"gyro": lambda imu: np.radians(imu.gyro)}, "converted from degrees to radians twice"),
        ({"gyro": lambda imu: 2.2 * imu.gyro}, r"turns 2\.\d+ times as fast as the camera"),
        ({"accel": lambda imu: imu.accel / 9.80665}, "it is in g; say --units accel=g"),
        ({"accel": lambda imu: 1e3 * imu.accel}, "give its unit with --units accel"),
        (
            {"gyro": lambda imu: imu.gyro * [1, 1, -1], "accel": lambda imu: imu.accel * [1, 1, -1]},
            "left-handed",
        ),
    ],
    ids=["degrees", "radians twice", "gain", "g", "mm", "mirrored"],
)
def test_units_and_axes_are_told(world, change, words):
    wrong = replace(world.imu, **{name: make(world.imu) for name, make in change.items()})
    with pytest.raises(DataError, match=words):
        world.changed(imu=wrong).calibrated()


def test_another_recording_is_refused(world):
    with pytest.raises(DataError, match="at no offset of the clocks does the gyro turn as the camera does"):
        world.changed(imu=recorded(5).imu).calibrated()


def test_too_few_views_are_refused(world):
    corners = world.corners
    with pytest.raises(DataError, match="found in 12 frames; at least 20"):
        world.changed(corners=corners.select(np.arange(len(corners.t)) < 12)).calibrated()
    with pytest.raises(DataError, match=r"seen for 2\.\d s"):
        world.changed(corners=corners.select(corners.t < corners.t[0] + 2.5)).calibrated()


@pytest.mark.parametrize("shift_m", [(0.0, 0.0, 0.0), (0.1, 0.1, 0.1)])
def test_a_rig_that_does_not_turn_is_told_to(shift_m):
    with pytest.raises(UnderConstrainedError, match=r"hardly turns.*each of the camera's three axes"):
        recorded(0, turn_rad=(0.0, 0.0, 0.0), shift_m=shift_m).calibrated()


@pytest.mark.parametrize(("axis", "name"), [(0, "nodding"), (1, "panning"), (2, "rolling")])
def test_the_axes_that_are_missing_are_named(axis, name):
    turn = np.zeros(3)
    turn[axis] = 0.3
    with pytest.raises(UnderConstrainedError, match=rf"one axis only, the camera's \w \({name}\)") as caught:
        recorded(0, turn_rad=turn).calibrated()
    others = {"nodding", "panning", "rolling"} - {name}
    asked = str(caught.value).split("turn it about")[1]
    assert all(other in asked for other in others)
    assert name not in asked


def test_turns_alone_are_enough():
    world = recorded(0, shift_m=(0.0, 0.0, 0.0))
    assert within(world, world.calibrated())


def test_a_weak_third_axis_shows_in_the_uncertainty():
    strong, weak = (recorded(0, turn_rad=(0.3, 0.3, roll), shift_m=(0.02, 0.02, 0.02)) for roll in (0.4, 0.0))
    assert strong.calibrated().translation_std.max() < weak.calibrated().translation_std.max()


@pytest.mark.parametrize(
    "damage",
    [
        lambda imu: imu.select((imu.t < 4.0) | (imu.t > 5.5)),
        lambda imu: imu.select(np.random.default_rng(3).random(len(imu.t)) > 0.1),
    ],
    ids=["gap", "lost samples"],
)
def test_gaps_of_the_imu_are_survived(world, damage):
    damaged = world.changed(imu=damage(world.imu))
    found = damaged.calibrated()
    assert within(world, found)
    assert len(found.adjusted.state.grid.begins) == (2 if np.diff(damaged.imu.t).max() > 1.0 else 1)


def test_frames_without_the_board_are_survived(world):
    corners = world.corners
    blind = corners.select((corners.t < 4.0) | (corners.t > 6.5))
    found = world.changed(corners=blind).calibrated()
    assert within(world, found)
    assert len(found.adjusted.state.grid.begins) == 2


@pytest.mark.parametrize(("fps", "rate_hz"), [(7.3, 83.0), (30.0, 50.0)])
def test_rates_need_not_go_together(fps, rate_hz):
    world = recorded(1, fps=fps, rate_hz=rate_hz, seconds=10.0)
    assert within(world, world.calibrated())


def test_frames_that_contradict_the_others_count_for_nothing(world, rng):
    corners = world.corners
    wrong = rng.choice(len(corners.t), len(corners.t) // 8, replace=False)
    pixels = corners.pixels + np.where(
        np.isin(corners.frame, wrong)[:, None], rng.normal(0.0, 20.0, (len(corners.t), 2))[corners.frame], 0.0
    )
    found = world.changed(corners=replace(corners, pixels=pixels)).calibrated()
    assert within(world, found)
    left_out = set(np.round(found.problem.corners.t[~found.frames_used], 6))
    assert left_out == set(np.round(corners.t[wrong], 6))


def test_corners_and_knocks_that_nothing_explains_are_left_out(world, rng):
    pixels = world.corners.pixels.copy()
    wrong = rng.choice(len(pixels), len(pixels) // 10, replace=False)
    pixels[wrong] += rng.normal(0.0, 15.0, (len(wrong), 2))
    accel = world.imu.accel.copy()
    knocked = rng.choice(len(accel), len(accel) // 50, replace=False)
    accel[knocked] += rng.normal(0.0, 30.0, (len(knocked), 3))
    bad = world.changed(corners=replace(world.corners, pixels=pixels), imu=replace(world.imu, accel=accel))
    found = bad.calibrated()
    assert within(world, found)
    assert np.mean(found.problem.corner_weight[wrong] == 0.0) > 0.9
    error = errors(world, found)
    assert error @ np.linalg.solve(found.cov[:7, :7], error) < 35.0


def test_corners_that_claim_too_little_or_too_much_are_weighed_by_their_residuals(world, rng):
    corners = world.corners
    claimed = np.where(rng.random(len(corners.frame)) < 0.5, 200.0, 1.0) * corners.sigma_px
    found = world.changed(corners=replace(corners, sigma_px=claimed)).calibrated()
    assert within(world, found)
    assert found.frames_used.all()
    sigma = found.problem.corner_scale * np.median(found.problem.corners.sigma_px)
    assert 0.05 < sigma < 0.2


def test_settings_are_checked():
    for wrong in ({"imu_model": "full"}, {"gravity": 1.0}, {"order": 3}, {"knots_per_s": 0.1}):
        with pytest.raises(ModelError):
            CamImuSettings(**wrong)
