"""Videos that the tests of live pages render, a camera that is unplugged, and requests to a page."""

import contextlib
import http.client
import time

import cv2
import numpy as np

from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.render import Plane, marker_texture, render_planes

CAMERA = Camera("pinhole", [300.0, 300.0, 159.5, 119.5], [], (320, 240))
MARKER_M, MARKERS = 0.06, {3: -0.1, 7: 0.1}
FPS = 25.0


def write_video(path, images, fps=FPS):
    images = iter(images)
    first = next(images)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, first.shape[1::-1])
    for image in (first, *images):
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image)
    writer.release()
    return path


def marker_pose(number, t):
    """Where a marker of the video is: it turns about an axis that lies askew, and drifts."""
    turn = SE3().retract(SE3().identity(), np.array([0.5 * np.sin(t), 0.4 * np.cos(t), t / 4, 0, 0, 0]))
    return np.array([*turn[:4], MARKERS[number] + 0.01 * t, 0.02 * np.sin(t), 0.4])


def marker_image(t, rng):
    planes = [Plane(marker_pose(k, t), marker_texture("4x4_50", k, MARKER_M)) for k in MARKERS]
    return render_planes(CAMERA, planes, rng=rng, supersample=2, noise=1.0)


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.005)
    raise AssertionError(f"what was waited for did not come in {seconds} s")


class Unplugged:
    """OpenCV's capture of a camera that gives `frames` numbered frames, each 5 ms, and then no more."""

    frames = 40

    def __init__(self, index):
        self.taken, self.open = 0, True

    def isOpened(self):  # noqa: N802 - OpenCV's name
        return self.open

    def read(self):
        time.sleep(0.005)
        self.taken += 1
        if self.taken > self.frames:
            return False, None
        return True, np.full((64, 96, 3), self.taken, np.uint8)

    def get(self, what):
        return 200.0

    def set(self, what, value):
        return False

    def release(self):
        self.open = False


@contextlib.contextmanager
def asked(server, path, *, method="GET", body=None, **headers):
    """An answer whose body is not read yet."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    connection.request(method, path, body=body, headers=headers)
    with contextlib.closing(connection), connection.getresponse() as answer:
        yield answer


def ask(server, path, **options):
    with asked(server, path, **options) as answer:
        return answer, answer.read()
