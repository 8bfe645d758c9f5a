"""Where the board was held: which parts of the image, which distances, which tilts, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import rotate, rotation_matrix
from vision3d.calibrate.calibration import Calibration

__all__ = ["Coverage", "coverage"]

Array = NDArray[np.float64]

CELLS = (8, 6)
"""Columns and rows of the cells that corners should reach."""
SIDE = 0.2
"""A corner of the image is this share of its width and of its height."""
TILTED_RAD = float(np.radians(15.0))
"""From here on a board counts as tilted …"""
WELL_TILTED_RAD = float(np.radians(25.0))
"""… and from here on as tilted enough to tell the focal length from the distance."""
DISTANCES = 1.6
"""Ratio of the farthest to the nearest view that counts as enough."""
SIDES = ("left", "right", "top", "bottom")
CORNERS = ("top left", "top right", "bottom left", "bottom right")
ENOUGH_VIEWS = 10


@dataclass(frozen=True, eq=False)
class Coverage:
    """What the views cover; every score is from 0 to 1.

    Attributes
    ----------
    counts : NDArray[np.int64]
        (rows, columns): corners in each cell of the image.
    image : float
        Share of the cells that hold a corner.
    image_corners : float
        Share of the four corners of the image that hold one.
    tilt_rad : Array
        (V,), angle between the board and the image.
    away : tuple[str, ...]
        (V,), which side of the board, as the image shows it, is the farther: left, right, top, bottom, or
        nothing for a board that is not tilted.
    tilts : float
        Share of those four sides that were turned away in some view.
    distance_m : Array
        (V,), of the middle of the corners from the camera.
    distances : float
        How much of the wanted spread of distances there is.
    views : float
        How many of the views that are worth having there are.
    advice : tuple[str, ...]
        What to add, most useful first; empty where nothing is missing.
    """

    counts: NDArray[np.int64]
    image: float
    image_corners: float
    tilt_rad: Array
    away: tuple[str, ...]
    tilts: float
    distance_m: Array
    distances: float
    views: float
    advice: tuple[str, ...]

    @property
    def bars(self) -> dict[str, float]:
        """The scores by their names, as a page shows them."""
        return {
            "image": self.image,
            "corners of the image": self.image_corners,
            "tilts": self.tilts,
            "distances": self.distances,
            "views": self.views,
        }


def coverage(calibration: Calibration) -> Coverage:
    """Look at where the board was held.

    Parameters
    ----------
    calibration : Calibration
        Poses and corners of the views.
    """
    width, height = calibration.camera.size
    pixels = np.concatenate([view.pixels for view in calibration.views])
    counts = np.histogram2d(
        pixels[:, 1], pixels[:, 0], bins=CELLS[::-1], range=((-0.5, height - 0.5), (-0.5, width - 0.5))
    )[0].astype(np.int64)
    at = (pixels + 0.5) / (width, height)
    reached = [
        bool(np.any((_end(at[:, 0], right)) & (_end(at[:, 1], bottom))))
        for bottom in (False, True)
        for right in (False, True)
    ]
    tilt, away = _tilts(calibration)
    distance = np.array([
        float(np.mean(np.linalg.norm(rotate(pose[:4], view.points) + pose[4:], axis=1)))
        for pose, view in zip(calibration.poses, calibration.views, strict=True)
    ])  # fmt: skip
    spread = float(np.log(distance.max() / distance.min()) / np.log(DISTANCES))
    turned = [side in away for side in SIDES]
    views = len(calibration.views)
    return Coverage(
        counts,
        float(np.mean(counts > 0)),
        float(np.mean(reached)),
        tilt,
        away,
        float(np.mean(turned)),
        distance,
        min(spread, 1.0),
        min(views / ENOUGH_VIEWS, 1.0),
        _advice(counts, reached, tilt, turned, spread, views),
    )


def _end(at: Array, far: bool) -> NDArray[np.bool_]:  # noqa: FBT001 - near or far end of one axis
    return at > 1.0 - SIDE if far else at < SIDE


def _tilts(calibration: Calibration) -> tuple[Array, tuple[str, ...]]:
    """Angles of the boards against the image, and the sides that lie farther away."""
    normal = rotation_matrix(calibration.poses[:, :4])[:, :, 2]
    normal = normal * np.where(normal[:, 2:] < 0.0, -1.0, 1.0)
    tilt: Array = np.arccos(np.clip(normal[:, 2], -1.0, 1.0))
    # on the board's plane depth grows along -(nx, ny) / nz
    away = []
    for (x, y, _), angle in zip(normal, tilt, strict=True):
        if angle < TILTED_RAD:
            away.append("")
        elif abs(x) > abs(y):
            away.append("left" if x > 0.0 else "right")
        else:
            away.append("top" if y > 0.0 else "bottom")
    return tilt, tuple(away)


def _advice(
    counts: NDArray[np.int64], reached: list[bool], tilt: Array, turned: list[bool], spread: float, views: int
) -> tuple[str, ...]:
    """What is missing, in the order of what it costs."""
    told = []
    if not np.any(tilt > WELL_TILTED_RAD):
        told.append("tilt the board by 30-45°: no view tells the focal length from the distance")
    if missing := [side for side, done in zip(SIDES, turned, strict=True) if not done]:
        told.append(f"tilt the board so that its {_listed(missing)} side is farther away (no view does)")
    if missing := [corner for corner, done in zip(CORNERS, reached, strict=True) if not done]:
        told.append(f"hold the board into the {_listed(missing)} of the image: no corners there")
    share = float(np.mean(counts > 0))
    if share < 0.8 and all(reached):
        told.append(f"cover more of the image: corners in {100 * share:.0f} % of it")
    if spread < 0.6:
        told.append("vary the distance: near enough to fill the image, and twice as far")
    if views < ENOUGH_VIEWS:
        told.append(f"take more views: {views} so far, {ENOUGH_VIEWS} to 20 are worth having")
    return tuple(told)


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
