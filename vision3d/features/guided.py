"""A second pass of matching, where a model says where the other end may be.

With a homography it is near one point, with a fundamental matrix near one line.  Fewer rivals are left, so
that repeated and weak features are matched as well which the ratio test had to refuse.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.features.features import Array, Features, Matches
from vision3d.features.matching import APART_PX, match_table

__all__ = ["distances_px", "guided_matches"]

Model = Literal["homography", "fundamental"]


def guided_matches(
    a: Features,
    b: Features,
    model: ArrayLike,
    kind: Model = "homography",
    *,
    within_px: float = 5.0,
    ratio: float | None = 0.9,
    most: float = np.inf,
    apart_px: float = APART_PX,
) -> Matches:
    """Match features that a model allows to belong together.

    Parameters
    ----------
    a, b : features of one kind
    model : (3, 3) homography from a's image to b's, or fundamental matrix with b' F a = 0, pixels
    within_px : how far from the place or line in b's image, px
    ratio : as in `match_features`, among the features that the model allows
    most : largest distance between descriptors

    Returns
    -------
    Matches
        each the other's nearest among those allowed; the most distinctive first.
    """
    matrix = np.asarray(model, dtype=np.float64)
    if matrix.shape != (3, 3):
        raise ShapeError(f"the model is a matrix (3, 3), got shape {matrix.shape}")
    if kind not in ("homography", "fundamental"):
        raise ModelError(f"the model is a homography or a fundamental matrix, got {kind!r}")
    if not within_px > 0.0:
        raise ModelError(f"within_px is above 0, got {within_px}")

    def gate(rows: slice) -> NDArray[np.bool_]:
        return distances_px(matrix, kind, a.pixels[rows, None], b.pixels[None]) <= within_px

    found = match_table(a, b, ratio=ratio, cross_check=True, apart_px=apart_px, gate=gate)
    return found.take(found.distance <= most)


def distances_px(model: Array, kind: Model, a: Array, b: Array) -> Array:
    """How far points (..., 2) of the second image are from where a model has those of the first, px."""
    first = np.concatenate([a, np.ones((*a.shape[:-1], 1))], axis=-1) @ model.T
    with np.errstate(divide="ignore", invalid="ignore"):
        if kind == "homography":
            away = np.hypot(
                first[..., 0] / first[..., 2] - b[..., 0], first[..., 1] / first[..., 2] - b[..., 1]
            )
        else:
            across = first[..., 0] * b[..., 0] + first[..., 1] * b[..., 1] + first[..., 2]
            away = np.abs(across) / np.hypot(first[..., 0], first[..., 1])
    return np.asarray(np.where(np.isfinite(away), away, np.inf), dtype=np.float64)
