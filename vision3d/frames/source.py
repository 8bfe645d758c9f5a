"""What every source of frames has in common."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

__all__ = ["Frame", "FrameSource", "in_colour", "quiet"]


@dataclass(frozen=True)
class Frame:
    """One image of a source.

    Parameters
    ----------
    index : counts from 0, also over a source that is played again
    t_ns : since the first frame, by the clock of the source: arrival of a camera's, the stamp in a video
    image : (h, w, 3) uint8 BGR, read-only
    name : of the file, or `frame 17`
    still : a photograph, which has nothing to do with the frame before; not one of a video
    """

    index: int
    t_ns: int
    image: NDArray[np.uint8]
    name: str
    still: bool = False

    @cached_property
    def grey(self) -> NDArray[np.uint8]:
        """The image (h, w) in grey levels."""
        import cv2

        return np.asarray(cv2.cvtColor(self.image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


class FrameSource(ABC):
    """An iterable of `Frame`, which closes what it has opened when it ends.

    Attributes
    ----------
    name : as it was asked for
    size : (width, height)
    fps : frames a second, nominal
    count : of frames, where the source knows it
    live : frames come when they come; a source that is not can be read as quickly as the reader wants
    stills : frames are photographs
    fault : why it broke off; empty where it did not
    left_out : sentences about single frames that could not be used
    begin_ns : time of the first frame by a clock that others share, where names of files tell it
    """

    live = stills = False

    def __init__(
        self, name: str, size: tuple[int, int], fps: float, count: int | None, *, loop: bool
    ) -> None:
        self.name, self.size, self.fps, self.count, self.loop = name, size, fps, count, loop
        self.fault = ""
        self.left_out: tuple[str, ...] = ()
        self.begin_ns: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Frame]:
        index, lap_ns = 0, 0
        period_ns = round(1e9 / self.fps)
        try:
            while True:
                last_ns = -1
                for t_ns, name, image in self._lap():
                    image.flags.writeable = False
                    last_ns = max(t_ns, last_ns + 1)
                    yield Frame(index, lap_ns + last_ns, image, name or f"frame {index}", self.stills)
                    index += 1
                if last_ns < 0 or not self.loop or self.fault:
                    return
                lap_ns += last_ns + period_ns
        finally:
            self.close()

    @abstractmethod
    def _lap(self) -> Iterator[tuple[int, str, NDArray[np.uint8]]]:
        """Times from 0, names and images from the beginning to the end."""

    def close(self) -> None:  # noqa: B027 - a folder of images has nothing to let go of
        """Let go of the camera or the file; a second time does nothing."""


@contextmanager
def quiet() -> Iterator[None]:
    """Keep OpenCV and FFmpeg from writing warnings about what is told in a sentence anyway."""
    import cv2

    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(level)


def in_colour(image: Any) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 whatever the source gives."""
    import cv2

    if image.dtype != np.uint8:
        image = (image // 257).astype(np.uint8) if image.dtype == np.uint16 else image.astype(np.uint8)
    if image.ndim == 2:
        image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    return np.ascontiguousarray(image[:, :, :3], dtype=np.uint8)
