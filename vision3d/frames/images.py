"""Image files as frames."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from vision3d.frames.files import begin_of, named_by_time, stamps_of
from vision3d.frames.source import FrameSource, in_colour, quiet

__all__ = ["ImageFrames"]

FOLDER_FPS = 10.0


class ImageFrames(FrameSource):
    """Image files of one size."""

    def __init__(self, name: str, paths: list[Path], fps: float | None, *, loop: bool) -> None:
        self._paths = paths
        self._t_ns, rate = stamps_of(paths, fps, FOLDER_FPS)
        self.stills = not named_by_time(paths)
        first = next((image for path in paths if (image := _read(path)) is not None), None)
        if first is None:
            raise FileFormatError(f"none of the {len(paths)} images of {name} can be read; are they images?")
        super().__init__(name, first.shape[1::-1], rate, len(paths), loop=loop)
        self.begin_ns = begin_of(paths) if fps is None else None

    def _lap(self) -> Iterator[tuple[int, str, NDArray[np.uint8]]]:
        bad: dict[Path, str] = {}
        for path, t_ns in zip(self._paths, self._t_ns.tolist(), strict=True):
            image = _read(path)
            if image is None:
                bad[path] = f"{path} cannot be read as an image and was left out"
            elif (size := image.shape[1::-1]) != self.size:
                bad[path] = (
                    f"{path} was left out: its size is {size[0]}x{size[1]}, that of the first image "
                    f"{self.size[0]}x{self.size[1]}"
                )
            else:
                yield t_ns, path.name, image
        self.left_out = tuple(bad.values())


def _read(path: Path) -> NDArray[np.uint8] | None:
    import cv2

    with quiet():
        image = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    return None if image is None else in_colour(image)
