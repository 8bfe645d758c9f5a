"""What the page says of good and of doubtful recordings."""

from dataclasses import replace

import numpy as np
import pytest
from cam_imu_worlds import BOARD, recorded

from factorlab.cam_imu.document import cam_imu_document
from factorlab.cam_imu.job import CamImuJob, calibrate_views
from sequential.noise import ImuNoise
from sequential.sensors.recording import ImuRecording
from vision3d.inertial import CamImuSettings
from vision3d.views import View

BEGIN = 1_700_000_000_000_000_000


def solved(world, **job):
    """The run of a simulated recording."""
    corners, camera = world.corners, world.rig.camera
    views = []
    for k in range(len(corners.t)):
        own = corners.frame == k
        views.append(
            View(
                f"frame {k}", camera.size, corners.points[own], corners.pixels[own], np.arange(own.sum()),
                corners.sigma_px[own],
            )
        )  # fmt: skip
    stamps = BEGIN + np.round(1e9 * corners.t).astype(np.int64)
    t = BEGIN + np.round(1e9 * world.imu.t).astype(np.int64)
    recording = ImuRecording(t=t, accel=world.imu.accel, gyro=world.imu.gyro)
    return calibrate_views(tuple(views), stamps, recording, CamImuJob(camera, BOARD, **job))


def verdict(run, metric):
    return next(one for one in cam_imu_document(run).verdicts if one.metric.startswith(metric))


@pytest.fixture(scope="module")
def world():
    return recorded(0)


@pytest.fixture(scope="module")
def run(world):
    return solved(world)


def test_a_good_recording_passes(world, run):
    document = cam_imu_document(run)
    assert not document.failed
    assert abs(run.time_offset_s - world.rig.time_offset_s) < 1e-4
    for metric in ("frames used", "σ of the", "halves agree", "board, measured", "least squares settled"):
        assert verdict(run, metric).verdict == "PASS", metric
    json = document.to_json()
    assert json["frames"]["used"] == len(run.names)
    assert len(json["biases"]["t_s"]) == len(json["biases"]["gyro_rad_s"])


def test_a_board_of_another_size_fails(world):
    corners = replace(world.corners, points=world.corners.points / 1.2)
    run = solved(world.changed(corners=corners))
    board = verdict(run, "board, measured by the IMU")
    assert board.verdict == "FAIL"
    assert board.value == pytest.approx(1.2 * 35.0, rel=0.02)
    assert "--square 4" in board.action


def test_noise_beyond_the_declared_is_told(world):
    noise = ImuNoise(3e-5, 2e-3, 2e-5, 3e-4)
    run = solved(world, settings=CamImuSettings(noise=noise), noise_name="imu.yaml", checks=False)
    gyro, accel = (verdict(run, f"{name} noise") for name in ("gyro", "accelerometer"))
    assert gyro.verdict == "WARN"
    assert "times what imu.yaml says" in gyro.meaning
    assert accel.verdict == "PASS"


def test_frames_that_count_for_nothing_are_named(world, rng):
    wrong = [10, 30, 31, 50, 70, 90]
    pushed = np.isin(world.corners.frame, wrong)
    pixels = world.corners.pixels + np.where(pushed[:, None], [9.0, -6.0], 0.0)
    run = solved(world.changed(corners=replace(world.corners, pixels=pixels)), checks=False)
    frames = verdict(run, "frames used")
    assert frames.verdict == "WARN"
    assert "6 contradict the others" in frames.meaning
    assert cam_imu_document(run).numbers["frames"]["left_out"] == [f"frame {k}" for k in wrong]


def test_a_jump_of_the_clock_shows_between_the_halves(world):
    corners = world.corners
    late = np.where(corners.t > np.median(corners.t), 0.004, 0.0)
    run = solved(world.changed(corners=replace(corners, t=corners.t + late)))
    assert verdict(run, "halves agree").verdict != "PASS"
