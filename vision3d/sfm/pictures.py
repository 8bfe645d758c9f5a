"""Pictures for a reconstruction, one after the other: what cannot be used is named, the rest goes on."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError
from vision3d.images import image_paths, read_image

__all__ = ["Photo", "PhotoSources", "photo_sources", "read_photo"]

Image = NDArray[np.uint8]
PhotoSources = str | os.PathLike[str] | Iterable[str | os.PathLike[str]] | Mapping[str, NDArray[Any]]
SMALLEST_SIDE = 32  # px: less has no room for features


@dataclass(frozen=True, eq=False)
class Photo:
    """One picture as it was read.

    Parameters
    ----------
    name : of the file, with folders only where two are alike
    image : (h, w, 3) uint8 BGR
    digest : of its pixels: a copy has the same
    focal_px : what EXIF says, for an image of this size; None where it says nothing
    device : what EXIF says of camera and zoom, for comparing only
    """

    name: str
    image: Image
    digest: str
    focal_px: float | None = None
    device: str = ""

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        height, width = self.image.shape[:2]
        return int(width), int(height)


def photo_sources(images: PhotoSources) -> dict[str, Path | Image]:
    """Pictures by their names: files of folders and patterns, or arrays as they are.

    Raises
    ------
    DataError
        where there is none, or a single one, of which there is no structure.
    """
    found: dict[str, Path | Image]
    if isinstance(images, Mapping):
        found = {str(name): np.asarray(image) for name, image in images.items()}
    else:
        paths = image_paths(images)
        plain = [path.name for path in paths]
        found = {
            path.name if plain.count(path.name) == 1 else "_".join(path.parts[-2:]): path for path in paths
        }
    if len(found) < 2:
        raise DataError(
            f"structure from motion needs two pictures or more of one scene, got {len(found)}"
            + (f" ({next(iter(found))})" if found else "")
        )
    return found


def read_photo(name: str, source: Path | Image) -> Photo:
    """Read one picture.

    Raises
    ------
    DataError
        where it cannot be read, or is too small to hold features.
    """
    if isinstance(source, Path):
        image = read_image(source, colour=True)
        focal_px, device = _exif(source, image)
    else:
        image, focal_px, device = _as_bgr(name, source), None, ""
    height, width = image.shape[:2]
    if min(width, height) < SMALLEST_SIDE:
        raise DataError(f"is {width}x{height} px; features need {SMALLEST_SIDE} px each way")
    digest = blake2b(np.ascontiguousarray(image).tobytes(), digest_size=16).hexdigest()
    return Photo(name, image, digest, focal_px, device)


def _as_bgr(name: str, array: Image) -> Image:
    if array.dtype != np.uint8 or array.ndim not in (2, 3):
        raise FileFormatError(
            f"is an array {array.shape} of {array.dtype}; a picture is (h, w) or (h, w, 3) of uint8"
        )
    return np.dstack([array] * 3) if array.ndim == 2 else array[..., :3]


def _exif(path: Path, image: Image) -> tuple[float | None, str]:
    """Focal length in pixels of the picture as it is, and what camera and zoom it was."""
    from vision3d.sfm.library import colmap

    theirs = colmap()
    try:
        told = theirs.Bitmap.read(path, as_rgb=False)
    except (RuntimeError, ValueError):
        told = None
    if told is None:  # no file that COLMAP reads; OpenCV has, and that is enough
        return None, ""
    focal_px = told.exif_focal_length()
    if focal_px is None or not np.isfinite(focal_px) or focal_px <= 0.0:
        return None, told.exif_camera_model() or ""
    scale = max(image.shape[:2]) / max(told.width, told.height)
    return float(focal_px) * scale, told.exif_camera_model() or ""
