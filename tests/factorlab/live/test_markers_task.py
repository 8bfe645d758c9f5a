"""The markers task: numbers without a camera model, and with one poses that are the true ones."""

import cv2
import numpy as np
import pytest
from live_worlds import CAMERA, MARKER_M, MARKERS, marker_image, marker_pose

from factorlab.live.camera.tasks.known import KnownCamera
from factorlab.live.camera.tasks.markers import PATIENCE, MarkersTask
from sequential.errors import DataError
from sequential.manifold import SE3
from vision3d.frames import Frame
from vision3d.markers import Marker, MarkerPose, Mode, TrackedMarker, marker_corners
from vision3d.pose import project_object


def frame(k, image):
    return Frame(k, round(k * 1e9 / 25), cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), f"frame {k}")


@pytest.fixture(scope="module")
def images():
    rng = np.random.default_rng(4)
    return [marker_image(k / 25, rng) for k in range(30)]


@pytest.fixture
def task():
    made = MarkersTask(KnownCamera(CAMERA), MARKER_M, "4x4_50")
    made.prepare()
    return made


def test_without_a_model_there_are_numbers_and_places_in_the_image(images):
    task = MarkersTask(KnownCamera(), dictionary="4x4_50")
    reading = task.read(frame(0, images[0]))
    assert [row["id"] for row in reading.rows] == sorted(MARKERS)
    for row in reading.rows:
        truth = CAMERA.project(marker_pose(row["id"], 0.0)[None, 4:])[0]
        assert (row["x_px"], row["y_px"]) == pytest.approx(tuple(truth), abs=0.3)
    assert "--camera" in reading.notes[0]
    assert task.actions == ()
    assert task.summary() == {"dictionary": "4x4_50", "ids": sorted(MARKERS)}
    with pytest.raises(DataError, match="without a camera model"):
        task.act("forget")


def test_poses_are_the_true_ones_within_what_they_claim(task, images):
    manifold, sigmas = SE3(), []
    for k, image in enumerate(images):
        reading = task.read(frame(k, image))
        assert reading.headline.startswith("2 markers")
        for row in reading.rows:
            truth = marker_pose(row["id"], k / 25)
            found = np.array([row[name] for name in ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")])
            assert row["seen"] == 1
            if k > 10:
                assert np.linalg.norm(manifold.local(found, truth)[:3]) < np.radians(4.0)
            error = (found[4:] - truth[4:]) / [row[f"sigma_{axis}"] for axis in ("x_m", "y_m", "z_m")]
            sigmas.append(error)
    assert np.median(np.abs(sigmas)) < 2.0
    assert np.max(np.abs(sigmas)) < 8.0


def test_axes_and_outline_are_drawn_where_the_marker_is(task, images):
    reading = task.read(frame(0, images[0]))
    origins = [mark.points[0] for mark in reading.marks if getattr(mark, "role", "") == "x"]
    truth = CAMERA.project(np.array([marker_pose(k, 0.0)[4:] for k in sorted(MARKERS)]))
    assert np.array(origins) == pytest.approx(truth, abs=0.5)


def test_a_marker_that_vanishes_is_told_and_comes_back(task, images):
    hidden = np.full_like(images[0], 120)
    for k in range(5):
        task.read(frame(k, images[k]))
    reading = task.read(frame(5, hidden))
    assert reading.headline == "no marker"
    assert [row["seen"] for row in reading.rows] == [0, 0]
    assert [row[-1] for row in reading.tables[0].rows] == ["not seen", "not seen"]
    assert task.read(frame(6, images[6])).headline.startswith("2 markers")


def test_the_same_frame_twice_changes_nothing(task, images):
    first = frame(0, images[0])
    assert task.read(first) is task.read(first)
    task.restart()
    task.read(frame(0, images[0]))  # time begins anew


def test_tracks_begin_anew_by_a_button(task, images):
    task.read(frame(9, images[9]))
    assert dict(task.actions).keys() == {"forget"}
    assert task.act("forget") == "the tracks begin anew"
    task.read(frame(0, images[0]))


def test_the_dictionary_is_found_out_frame_by_frame(images):
    task = MarkersTask(KnownCamera())
    readings = [task.read(frame(k, images[0])) for k in range(12)]
    assert readings[-1].headline == "2 markers"
    assert task.summary()["dictionary"] == "4x4_50"
    nothing = np.full_like(images[0], 120)
    for k in range(PATIENCE + 2):
        task.read(frame(20 + k, nothing))
    assert task.summary()["dictionary"] == "auto"


def test_an_open_pose_says_what_to_do(task):
    """Two readings, three to two: amber, with the other pose in the table."""
    poses = [np.array([np.cos(a), np.sin(a), 0.0, 0.0, 0.02, 0.01, 1.1]) for a in (0.1, -0.1)]
    cov = np.diag([1e-2, 1e-2, 1e-4, 1e-8, 1e-8, 4e-6])
    modes = tuple(Mode(pose, cov, share, 0.1, pose) for pose, share in zip(poses, (0.6, 0.4), strict=True))
    corners = project_object(CAMERA, poses[0], marker_corners(MARKER_M))
    marker = Marker(3, corners, np.full(4, 0.2))
    both = MarkerPose(modes)
    reading = task._placed((TrackedMarker(3, both, seen=True, since_s=0.0, measured=both, marker=marker,
                                          velocity=np.zeros(6)),))  # fmt: skip
    assert (reading.headline, reading.state) == ("1 marker, 1 with two poses", "warn")
    assert reading.notes == ("3: two poses fit, odds 1.5 : 1; tilt it, or come nearer",)
    assert {mark.role for mark in reading.marks} == {"warn", "x", "y", "z"}
    row = reading.rows[0]
    assert row["odds"] == pytest.approx(1.5)
    assert row["sigma_z_m"] == pytest.approx(2e-3, rel=0.05)
    assert (row["other_qx"], row["other_z_m"]) == pytest.approx((-np.sin(0.1), 1.1))


def test_photographs_are_looked_at_alone(task, images):
    whole = [Frame(k, k, frame(0, images[12 * k]).image, f"{k}.png", still=True) for k in range(2)]
    task.read(whole[0])
    together = task.read(whole[1]).rows
    alone = MarkersTask(KnownCamera(CAMERA), MARKER_M, "4x4_50").read(whole[1]).rows
    assert together == alone
