"""A camera by its index or its address."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.frames.source import FrameSource, in_colour, quiet

__all__ = ["CameraFrames", "CameraLostError"]

READ_TIMEOUT_MS = 3000.0
BAD_FRAMES = 5  # one after the other that a camera may fail to give; the first after a wake-up often do


class CameraLostError(DataError):
    """A camera that cannot be opened."""


class CameraFrames(FrameSource):
    """A camera by its index or its address."""

    live = True

    def __init__(self, name: str, size: tuple[int, int] | None, fps: float | None) -> None:
        import cv2

        self._closed = False
        sides = (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        wish: list[tuple[int, float]] = [] if size is None else list(zip(sides, size, strict=True))
        if size is not None:  # what is not compressed comes slowly where it is large
            wish.insert(0, (cv2.CAP_PROP_FOURCC, float(cv2.VideoWriter.fourcc(*"MJPG"))))
        if fps is not None:
            wish.append((cv2.CAP_PROP_FPS, fps))
        with quiet():
            self._capture = cv2.VideoCapture(int(name) if name.isdecimal() else name)
            for number, value in wish:
                self._capture.set(number, value)
            self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # the newest frame is wanted, not the oldest
            self._capture.set(cv2.CAP_PROP_READ_TIMEOUT_MSEC, READ_TIMEOUT_MS)
            self._first = self._next() if self._capture.isOpened() else None
        if self._first is None:
            opened = self._capture.isOpened()
            self._capture.release()
            raise CameraLostError(_no_camera(name, opened=opened))
        height, width = self._first.shape[:2]
        told = float(self._capture.get(cv2.CAP_PROP_FPS))
        super().__init__(name, (width, height), told if 0.1 < told < 1000.0 else 30.0, None, loop=False)

    def _lap(self) -> Iterator[tuple[int, str, NDArray[np.uint8]]]:
        began, taken, image = time.monotonic_ns(), 0, self._first
        while image is not None:
            yield time.monotonic_ns() - began, "", image
            taken += 1
            image = self._next()
        if not self._closed:
            seconds = (time.monotonic_ns() - began) * 1e-9
            self.fault = (
                f"{_called(self.name)} stopped giving frames after {taken} ({seconds:.1f} s); "
                "is it still plugged in?"
            )

    def _next(self) -> NDArray[np.uint8] | None:
        for _ in range(BAD_FRAMES):
            good, image = self._capture.read()
            if good:
                return in_colour(image)
            if self._closed or not self._capture.isOpened():
                break
        return None

    def close(self) -> None:
        """Let go of the camera."""
        self._closed = True
        self._capture.release()


def _called(name: str) -> str:
    return f"camera {name}" if name.isdecimal() else name


def _no_camera(name: str, *, opened: bool) -> str:
    if opened:
        return f"{_called(name)} is there but gives no frame; does another program use it?"
    if "://" in name:
        return f"{name} gives no video; check the address, and that its server runs"
    there = sorted(path.name[5:] for path in Path("/dev").glob("video*"))
    known = f"there are {', '.join(there)}" if there else "this computer has none"
    return f"there is no camera {name} that can be opened; {known}; a video file or a folder will do as well"
