"""Videos that the tests render, and sessions over them."""

import contextlib
import time

import cv2
import numpy as np
import pytest

from factorlab.live.camera import CameraSession, PageServer, TaskSettings, task_choices
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.frames import open_frames
from vision3d.render import Plane, marker_texture, render_planes

CAMERA = Camera("pinhole", [300.0, 300.0, 159.5, 119.5], [], (320, 240))
MARKER_M, MARKERS = 0.06, {3: -0.1, 7: 0.1}


def write_video(path, images, fps=25.0):
    images = iter(images)
    first = next(images)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, first.shape[1::-1])
    for image in (first, *images):
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def marker_pose(number, t):
    """Where a marker of the video is: it turns about an axis that lies askew, and drifts."""
    turn = SE3().retract(SE3().identity(), np.array([0.5 * np.sin(t), 0.4 * np.cos(t), t / 4, 0, 0, 0]))
    return np.array([*turn[:4], MARKERS[number] + 0.01 * t, 0.02 * np.sin(t), 0.4])


def marker_image(t, rng):
    planes = [Plane(marker_pose(k, t), marker_texture("4x4_50", k, MARKER_M)) for k in MARKERS]
    return render_planes(CAMERA, planes, rng=rng, supersample=2, noise=1.0)


@pytest.fixture(scope="session")
def marker_video(tmp_path_factory):
    """Two markers that move, 50 frames at 25 a second."""
    rng = np.random.default_rng(1)
    path = tmp_path_factory.mktemp("video") / "markers.avi"
    return write_video(path, (marker_image(k / 25, rng) for k in range(50)))


@pytest.fixture
def live(tmp_path):
    """Open sessions with their pages; they end with the test."""
    with contextlib.ExitStack() as open_ones:

        def begin(source, task="markers", *, settings=None, served=True, loop=False, **options):
            session = CameraSession(
                open_frames(source, loop=loop),
                task_choices(settings or TaskSettings(dictionary="4x4_50")),
                task,
                recordings=tmp_path / "recordings",
                **options,
            )
            open_ones.callback(session.close)
            server = PageServer(session, 0) if served else None
            if server:
                open_ones.callback(server.close)
            return session, server

        yield begin


def wait_for(condition, seconds=20):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("what was waited for did not come")
