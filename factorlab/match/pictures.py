"""A picture to be matched: read, made small enough, and its features found at full size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.match.settings import MatchSettings
from sequential.errors import DataError

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.features import Features

__all__ = ["Picture", "camera_of", "read_picture"]


@dataclass(frozen=True, eq=False)
class Picture:
    """One of the two: its name, its grey levels (h, w), and its features in pixels of them."""

    name: str
    image: NDArray[np.uint8]
    features: Features
    camera: Camera | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.image.shape[1], self.image.shape[0]

    @property
    def corners(self) -> NDArray[np.float64]:
        """(4, 2) centres of the pixels in its corners, clockwise from the top left."""
        right, low = self.size[0] - 1.0, self.size[1] - 1.0
        return np.array([[0.0, 0.0], [right, 0.0], [right, low], [0.0, low]])


def read_picture(path: str, camera: Path | None, settings: MatchSettings) -> Picture:
    """Read a picture and find its features.

    Raises
    ------
    DataError, FileFormatError
        where it, or the file of its camera, cannot be read, or they do not belong together.
    """
    from vision3d.features import detect_features
    from vision3d.images import read_image

    image = read_image(path)
    known = None if camera is None else camera_of(camera, (image.shape[1], image.shape[0]))
    small, zoom = _shrunk(image, settings.max_size)
    found = detect_features(small, settings.features, count=settings.count)
    if zoom is not None:
        # corners of images coincide, and the first pixel's centre is half a pixel from its corner
        scale = float(zoom.mean())
        found = replace(
            found, pixels=(found.pixels + 0.5) * zoom - 0.5, size_px=found.size_px * scale,
            sigma_px=found.sigma_px * scale,
        )  # fmt: skip
    return Picture(Path(path).name, image, found, known)


def camera_of(path: Path, size: tuple[int, int]) -> Camera:
    """The camera of a file, which must be of pictures of this size.

    Raises
    ------
    DataError
        where the picture has another shape.
    """
    from vision3d.camera_files.reading import read_camera

    camera = read_camera(path, size=size)
    if camera.size == size:
        return camera
    if abs(camera.size[0] * size[1] - camera.size[1] * size[0]) <= max(*camera.size, *size):
        return camera.resized(size)
    told, given = ("x".join(map(str, one)) for one in (camera.size, size))
    raise DataError(f"{path} is of a camera with images of {told}; the picture is {given}, of another shape")


def _shrunk(image: NDArray[np.uint8], most: int) -> tuple[NDArray[np.uint8], NDArray[np.float64] | None]:
    """The picture with a longer side of at most so many pixels, and how many px of the original each is."""
    height, width = image.shape
    if max(height, width) <= most:
        return image, None
    import cv2

    share = most / max(height, width)
    size = (max(1, round(width * share)), max(1, round(height * share)))
    small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return small, np.array([width / size[0], height / size[1]])
