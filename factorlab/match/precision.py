"""How sure a geometry is, in pixels that mean something to a user."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factorlab.match.fitting import Geometry
from factorlab.match.job import Matched

__all__ = ["corner_places", "motion_px"]

Array = NDArray[np.float64]


def corner_places(done: Matched, geometry: Geometry) -> tuple[Array, Array]:
    """Where the corners (4, 2) of the first picture lie in the second, px, and covariances (4, 2, 2)."""
    from vision3d.robust import transfer, transfer_cov

    corners = done.a.corners
    places = transfer(geometry.matrix, corners)
    cov = np.zeros((9, 9)) if geometry.cov is None else geometry.cov
    return places, transfer_cov(geometry.matrix, cov, corners)


def motion_px(done: Matched) -> float | None:
    """Median length of the inliers' motion, px; None where there are none."""
    if done.geometry is None or not done.geometry.inliers.any():
        return None
    at = done.geometry.inliers
    return float(np.median(np.linalg.norm(done.pixels_b[at] - done.pixels_a[at], axis=1)))
