"""Images to features and matches by this package alone, as our own mapper takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from vision3d.camera import Camera
from vision3d.features import detect_features, match_features
from vision3d.sfm.growth import Scene

__all__ = ["match_images"]


def match_images(
    images: Mapping[str, NDArray[Any]],
    cameras: Camera | Sequence[Camera],
    camera_of: Sequence[int] = (),
    *,
    kind: str = "sift",
    count: int = 2000,
    calibrate: bool = False,
) -> tuple[Scene, dict[tuple[int, int], NDArray[np.int64]]]:
    """Features of every image, and matches of every pair.

    Parameters
    ----------
    images : by their names, (h, w) grey levels or (h, w, 3) BGR, uint8
    cameras : one for all, or several, with `camera_of` (V,) saying which took which image
    kind : of features, one of `vision3d.features.KINDS`
    count : features of an image at most
    calibrate : whether the intrinsics are to be refined

    Raises
    ------
    ShapeError
        where there are several cameras and `camera_of` does not name one for every image.
    """
    several = (cameras,) if isinstance(cameras, Camera) else tuple(cameras)
    of = np.asarray(camera_of if len(several) > 1 else np.zeros(len(images)), dtype=np.int64)
    if len(of) != len(images) or (len(of) and not 0 <= of.min() <= of.max() < len(several)):
        raise ShapeError(f"camera_of names one of {len(several)} cameras for each of {len(images)} images")
    found = [detect_features(image, kind, count=count) for image in images.values()]
    colors = []
    for image, features in zip(images.values(), found, strict=True):
        x, y = np.rint(features.pixels).astype(np.int64).T
        colors.append(np.atleast_3d(image)[y, x] if len(x) else np.zeros((0, 3), dtype=np.uint8))
    scene = Scene(
        tuple(images), several, of, tuple(one.pixels for one in found),
        tuple(np.broadcast_to(one[:, ::-1], (len(one), 3)).astype(np.uint8) for one in colors), calibrate,
    )  # fmt: skip
    pairs = {(a, b): match_features(found[a], found[b]).pairs for a, b in combinations(range(len(found)), 2)}
    return scene, {pair: rows for pair, rows in pairs.items() if len(rows)}
