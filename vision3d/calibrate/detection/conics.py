"""Where the centre of a circle is: the centre of its image, an ellipse, is not the image of its centre.

A circle of radius r about c becomes, under a smooth map f with the Jacobian J at c, the curve
``f(c) + r J (n + e(n))`` for the directions n.  Of e, only the part along n that varies as cosine and sine of
the direction moves the centre of the ellipse: by ``2 r J mean(n (n . e))``.  For a plane seen through a
pinhole this is the known bias (Heikkila 2000, "Geometric camera calibration using circular control points");
the distortion of the lens, which bends the circle as well, is part of f here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vision3d.calibrate.detection.lattice import Array

__all__ = ["circle_images"]

Map = Callable[[Array], Array]
ANGLES = 2.0 * np.pi * np.arange(24) / 24.0


def circle_images(to_pixels: Map, centres: Array, radius: float) -> tuple[Array, Array]:
    """How circles (N, 2) of a plane are seen.

    Parameters
    ----------
    to_pixels : takes points (M, 2) of the plane to pixels (M, 2)
    centres : (N, 2), radius : in the plane's unit

    Returns
    -------
    tuple[Array, Array]
        Centre of the ellipse minus image of the centre, (N, 2) px; the ellipses as a, b, c (N, 3) of
        ``(u, v) [[a, b], [b, c]] (u, v)ᵀ = 1`` about their centres.
    """
    directions = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
    rim = to_pixels((centres[:, None] + radius * directions).reshape(-1, 2)).reshape(len(centres), -1, 2)
    offset = rim - to_pixels(centres)[:, None]
    # the first harmonics of the offset are r J: their products with the directions average to one half
    J = 2.0 * np.einsum("nki,kj->nij", offset, directions) / len(directions)
    local = np.einsum("nij,nkj->nki", np.linalg.inv(J), offset)
    excess = np.einsum("nki,ki->nk", local, directions) - 1.0
    shift = 2.0 * np.einsum("nk,ki->ni", excess, directions) / len(directions)
    bias: Array = np.einsum("nij,nj->ni", J, shift)
    M = np.linalg.inv(np.einsum("nij,nkj->nik", J, J))
    return bias, np.ascontiguousarray(np.stack([M[:, 0, 0], M[:, 0, 1], M[:, 1, 1]], axis=1))
