"""Pictures of the board: files, folders and patterns, and of videos the sharpest frames."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.images import ImageSet, LeftOut, read_images

__all__ = ["VIDEO_SUFFIXES", "held_pictures", "open_pictures", "sharpest_frames", "sharpness"]

Picture = NDArray[np.uint8]
VIDEO_SUFFIXES = frozenset(
    (".avi", ".m4v", ".mjpeg", ".mjpg", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".ts", ".webm", ".wmv")
)
LONGEST = 100_000  # frames, of a video that does not tell how many it has
LOOKED_AT = 1500  # frames of a video that are judged


def open_pictures(given: Sequence[str], frames: int = 40) -> ImageSet:
    """Read the pictures that names, patterns, folders and videos stand for.

    Parameters
    ----------
    frames : how many are taken from a video: the sharpest of as many equal stretches

    Raises
    ------
    DataError
        where nothing is found, nothing of it can be read, or a video has another size than the pictures.
    """
    videos = dict.fromkeys(Path(one) for one in given if Path(one).suffix.lower() in VIDEO_SUFFIXES)
    rest = [one for one in given if Path(one) not in videos]
    sets = [read_images(rest)] if rest else []
    alike = len({path.name for path in videos}) < len(videos)
    sets += [sharpest_frames(path, frames, str(path) if alike else path.name) for path in videos]
    if len({one.size for one in sets}) > 1:
        listed = " and ".join(f"{one.size[0]}x{one.size[1]}" for one in sets)
        raise DataError(f"a camera is calibrated at one size, but these are {listed}; give those of one")
    images = tuple(pair for one in sets for pair in one.images)
    return ImageSet(images, sets[0].size, tuple(left for one in sets for left in one.left_out))


def held_pictures(images: Sequence[tuple[str, Picture]]) -> ImageSet:
    """Pictures that are in memory already: rendered ones, or what a live view has kept; grey (h, w).

    Raises
    ------
    DataError
        where there is none, or sizes differ.
    """
    sizes = {image.shape[1::-1] for _, image in images}
    if len(sizes) != 1:
        listed = ", ".join(f"{width}x{height}" for width, height in sorted(sizes)) or "none"
        raise DataError(f"a calibration takes pictures of one size, got {listed}")
    width, height = sizes.pop()
    return ImageSet(tuple(images), (int(width), int(height)))


def sharpest_frames(path: Path, count: int, name: str) -> ImageSet:
    """The sharpest frame of each of `count` equal stretches of a video, which is called `name`."""
    from vision3d.frames import open_frames

    best: dict[int, tuple[float, str, Picture]] = {}
    with open_frames(path) as source:
        stretch = max(1.0, (source.count or LONGEST) / count)
        step = max(1, (source.count or 0) // LOOKED_AT)
        for frame in source:
            if frame.index % step:
                continue
            place = int(frame.index / stretch)
            value = sharpness(frame.grey)
            if place not in best or value > best[place][0]:
                best[place] = (value, f"{name} frame {frame.index}", frame.grey)
        left_out = (LeftOut(name, source.fault),) if source.fault else ()
        size = source.size
    images = [(called, image) for _, called, image in best.values()]
    step = max(1, -(-len(images) // count))  # a video that did not tell its length
    return ImageSet(tuple(images[::step]), size, left_out)


def sharpness(image: Picture) -> float:
    """Variance of the Laplacian at half the size, where noise counts less."""
    import cv2

    return float(cv2.Laplacian(cv2.pyrDown(image), cv2.CV_64F).var())
