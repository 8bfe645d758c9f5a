"""Corners stay on what they were found on, by every detector, and are dropped where they leave the image."""

import cv2
import numpy as np
import pytest

from factorlab.live.camera.tasks.features import DETECTORS, FeaturesTask, detect
from sequential.errors import DataError
from vision3d.frames import Frame

SIZE = (320, 240)


@pytest.fixture(scope="module")
def texture():
    rng = np.random.default_rng(5)
    coarse = rng.uniform(0, 255, (75, 100)).astype(np.float32)
    image = cv2.resize(coarse, (800, 600), interpolation=cv2.INTER_CUBIC)
    return np.clip(image, 0, 255).astype(np.uint8)


def view(texture, shift):
    """The texture seen by a camera that has moved by `shift` px."""
    matrix = np.array([[1.0, 0.0, -200.0 - shift[0]], [0.0, 1.0, -150.0 - shift[1]]])
    image = cv2.warpAffine(texture, matrix, SIZE, flags=cv2.INTER_CUBIC)
    return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)


def frames(texture, shifts):
    for k, shift in enumerate(shifts):
        yield Frame(k, round(k * 1e9 / 25), view(texture, shift), f"frame {k}")


def places(reading):
    return {row["id"]: (row["x_px"], row["y_px"]) for row in reading.rows}


@pytest.mark.parametrize("detector", DETECTORS)
def test_corners_follow_a_known_motion(texture, detector):
    task, step = FeaturesTask(detector), np.array([2.3, -1.4])
    readings = [task.read(frame) for frame in frames(texture, step * np.arange(15)[:, None])]
    first, last = places(readings[0]), places(readings[-1])
    kept = sorted(first.keys() & last.keys())
    assert len(kept) > 0.5 * len(first) > 20
    error = np.array([last[k] for k in kept]) - [first[k] for k in kept] + 14 * step
    assert np.sqrt((error**2).mean()) < 0.15
    numbers = {one.name: one.value for one in readings[-1].numbers}
    assert numbers["median motion"] == pytest.approx(np.hypot(*step), abs=0.05)
    assert numbers["speed"] == pytest.approx(25 * np.hypot(*step), rel=0.03)
    assert numbers["followed"] > 90


def test_corners_that_leave_the_image_are_lost(texture):
    task = FeaturesTask()
    readings = [task.read(frame) for frame in frames(texture, [(8.0 * k, 0.0) for k in range(12)])]
    for reading in readings:
        xy = np.array(list(places(reading).values()))
        assert (xy >= 0).all()
        assert (xy <= np.array(SIZE) - 1).all()
    assert sum(one.value for reading in readings for one in reading.numbers if one.name == "lost") > 20


def test_a_cut_loses_every_corner(texture):
    task = FeaturesTask()
    first, second = frames(texture, [(0, 0), (173.0, 111.0)])
    task.read(first)
    lost = {one.name: one.value for one in task.read(second).numbers}
    assert lost["followed"] < 10


@pytest.mark.parametrize("detector", DETECTORS)
def test_corners_keep_their_distance(texture, detector):
    grey = cv2.cvtColor(view(texture, (0, 0)), cv2.COLOR_BGR2GRAY)
    taken = detect(grey, detector, np.empty((0, 2), np.float32), 40)
    more = detect(grey, detector, taken, 200)
    every = np.concatenate([taken, more])
    distance = np.linalg.norm(every[:, None] - every[None], axis=2) + 1e3 * np.eye(len(every))
    assert len(taken) == 40
    assert len(more) > 10
    assert distance.min() > 8.5


def test_nothing_to_see_is_said(texture):
    black = Frame(0, 0, np.zeros((240, 320, 3), np.uint8), "")
    task = FeaturesTask()
    for _ in range(2):
        reading = task.read(black)
        assert (reading.headline, reading.state, reading.rows) == ("0 corners", "idle", ())
        assert "texture" in reading.notes[0]


def test_the_detector_is_changed_by_a_button(texture):
    task = FeaturesTask("fast")
    assert [name for name, _ in task.actions] == ["orb", "harris"]
    assert task.act("harris") == "corners by Harris"
    assert [name for name, _ in task.actions] == ["fast", "orb"]
    with pytest.raises(DataError, match="no detector 'sift', only fast, orb, harris"):
        task.act("sift")
