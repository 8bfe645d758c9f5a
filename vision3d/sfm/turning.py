"""Whether pairs of pictures are explained by a camera that only turned, whatever its focal length.

A homography H between two pictures taken from one place is K R K⁻¹ up to scale (Hartley, IJCV 22(1), 1997),
so that some focal length makes a rotation of K⁻¹ H K. The picture of a plane from two places has none that
does so in all pairs: depth over distance enters, and differs from pair to pair.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["FARTHEST_FROM_TURNING", "distance_from_turning"]

Array = NDArray[np.float64]
FOCALS = np.geomspace(0.3, 6.0, 120)  # of the longer side of the picture
FARTHEST_FROM_TURNING = 0.03


def distance_from_turning(homographies: Sequence[Array], size: tuple[int, int]) -> tuple[float, float]:
    """How far homographies (3, 3) are from rotations at the focal length that suits them best.

    Parameters
    ----------
    homographies : from picture to picture, in pixels
    size : (width, height) of the pictures

    Returns
    -------
    tuple
        median over pairs of the Frobenius norm of M Mᵀ − 1, M = K⁻¹ H K of determinant 1: 0 where the camera
        only turned, above `FARTHEST_FROM_TURNING` where it did not; inf without a pair.  And that focal
        length, px.
    """
    if not len(homographies):
        return float("inf"), float("nan")
    longer = max(size)
    centre = np.array([0.5 * size[0], 0.5 * size[1]])
    stack = np.array(homographies, dtype=np.float64)
    distances = np.array([_distances(stack, focal * longer, centre) for focal in FOCALS])
    medians = np.median(distances, axis=1)
    best = int(np.argmin(medians))
    return float(medians[best]), float(FOCALS[best] * longer)


def _distances(homographies: Array, focal_px: float, centre: Array) -> Array:
    """(E,) of every homography, for one focal length."""
    K = np.array([[focal_px, 0.0, centre[0]], [0.0, focal_px, centre[1]], [0.0, 0.0, 1.0]])
    M = np.linalg.solve(K, homographies @ K)
    scale = np.cbrt(np.linalg.det(M))
    with np.errstate(divide="ignore", invalid="ignore"):
        M = M / scale[:, None, None]
    apart = np.linalg.norm(M @ M.transpose(0, 2, 1) - np.eye(3), axis=(1, 2))
    return np.where(np.isfinite(apart), apart, np.inf)
