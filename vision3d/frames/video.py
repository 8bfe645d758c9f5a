"""A video file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from vision3d.frames.source import FrameSource, in_colour, quiet

__all__ = ["VideoFrames"]


class VideoFrames(FrameSource):
    """A video file."""

    def __init__(self, path: Path, *, loop: bool) -> None:
        import cv2

        self._path = path
        capture = self._open()
        first = capture.read()[1] if capture.isOpened() else None
        told, frames = (float(capture.get(p)) for p in (cv2.CAP_PROP_FPS, cv2.CAP_PROP_FRAME_COUNT))
        capture.release()
        if first is None:
            raise FileFormatError(
                f"{path} holds no frame of a video that can be read; is it complete, and a video at all?"
            )
        rate = told if 0.1 < told < 1000.0 else 30.0
        super().__init__(
            str(path), first.shape[1::-1], rate, int(frames) if 0 < frames < 2**31 else None, loop=loop
        )
        self._capture = capture

    def _open(self) -> Any:
        import cv2

        with quiet():
            capture = cv2.VideoCapture(str(self._path))
        # pixels as the sensor gave them: a camera model knows nothing of how the telephone was held
        capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        return capture

    def _lap(self) -> Iterator[tuple[int, str, NDArray[np.uint8]]]:
        import cv2

        self.close()
        self._capture = self._open()
        taken, first_ms, last_ns = 0, None, -1
        while True:
            with quiet():
                good, image = self._capture.read()
            if not good:
                break
            stamp_ms = float(self._capture.get(cv2.CAP_PROP_POS_MSEC))
            first_ms = stamp_ms if first_ms is None else first_ms
            t_ns = round((stamp_ms - first_ms) * 1e6)
            last_ns = t_ns if t_ns > last_ns else last_ns + round(1e9 / self.fps)
            yield last_ns, "", in_colour(image)
            taken += 1
        if self.count is not None and self.count - taken > max(2, self.count // 50):
            self.fault = f"{self._path} ends after {taken} of {self.count} frames; it was cut, or is damaged"

    def close(self) -> None:
        """Let go of the file."""
        self._capture.release()
