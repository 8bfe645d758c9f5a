"""Sessions over rendered videos, and of the line follower."""

import contextlib

import numpy as np
import pytest
from chromium import Chromium
from live_worlds import FPS, marker_image, write_video

from factorlab.l19.follower import FollowerSettings
from factorlab.live.camera import CameraSession, PageServer, TaskSettings, task_choices
from factorlab.live.follower import FollowerServer, FollowerSession
from vision3d.frames import open_frames


@pytest.fixture(scope="session")
def marker_video(tmp_path_factory):
    """Two markers that move, 50 frames at 25 a second."""
    rng = np.random.default_rng(1)
    path = tmp_path_factory.mktemp("video") / "markers.avi"
    return write_video(path, (marker_image(k / FPS, rng) for k in range(50)))


@pytest.fixture
def live(tmp_path):
    """Begin sessions, each with its page; they end with the test."""
    with contextlib.ExitStack() as begun:

        def begin(source, task="markers", *, choices=None, loop=False, settings=None, **options):
            session = CameraSession(
                open_frames(source, loop=loop),
                choices or task_choices(settings or TaskSettings(dictionary="4x4_50")),
                task,
                recordings=tmp_path / "recordings",
                **options,
            )
            begun.callback(session.close)
            server = PageServer(session, 0)
            begun.callback(server.close)
            return session, server

        yield begin


@pytest.fixture
def follower():
    """Begin to follow a line, each time with a page; all end with the test."""
    with contextlib.ExitStack() as begun:

        def begin(*, pace=5.0, start=True, steps=None, wait=True, own=None, **settings):
            session = FollowerSession(
                FollowerSettings(**{"curve": "circuit"} | settings), steps=steps, wait=wait, own=own
            )
            session.pace = pace
            begun.callback(session.close)
            server = FollowerServer(session, 0)
            begun.callback(server.close)
            if start:
                session.start()
            return session, server

        yield begin


@pytest.fixture
def window(browser, tmp_path):
    """A browser whose console has to stay silent."""
    with Chromium(browser, tmp_path / "profile") as one:
        yield one
        assert one.console == []
