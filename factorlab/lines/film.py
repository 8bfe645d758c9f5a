"""A video of the frames with what was found drawn in, kept in a temporary file until it is wanted."""

from __future__ import annotations

import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from factorlab.lines.files import drawn
from factorlab.lines.job import Read
from vision3d.frames import Frame

__all__ = ["Film"]


class Film:
    """Write frames one after the other as Motion JPEG."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="factorlab-line-")
        self._writer: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()
        self._folder.cleanup()

    @property
    def _path(self) -> Path:
        return Path(self._folder.name) / "line.avi"

    def add(self, frame: Frame, read: Read, fps: float) -> None:
        """Draw a frame and write it."""
        import cv2

        image = drawn(frame.image, read)
        if self._writer is None:
            size = (image.shape[1], image.shape[0])
            self._writer = cv2.VideoWriter(str(self._path), cv2.VideoWriter.fourcc(*"MJPG"), fps, size)
        self._writer.write(image)

    def content(self) -> bytes:
        """The whole file."""
        self._close()
        return self._path.read_bytes()

    def _close(self) -> None:
        if self._writer is not None:
            self._writer.release()
            self._writer = None
