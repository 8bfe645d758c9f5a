"""Similarities of the plane and of space, from matched points most of which may be wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.robust.found import Found, relative_weights, result_of
from vision3d.robust.model import Addresses, CompiledModel
from vision3d.robust.result import RobustFit
from vision3d.robust.scaling import paired_points, spread
from vision3d.robust.search import search
from vision3d.robust.settings import RansacSettings

__all__ = ["PLANE_SIMILARITY", "SPACE_SIMILARITY", "fit_similarity"]

Array = NDArray[np.float64]


def _load_plane() -> Addresses:
    from vision3d.kernels import robust_similarity as kernels

    return Addresses(
        kernels.plane_similarity_solve.address,
        kernels.plane_similarity_residuals.address,
        kernels.plane_similarity_fit.address,
    )


def _load_space() -> Addresses:
    from vision3d.kernels import robust_similarity as kernels

    return Addresses(
        kernels.space_similarity_solve.address,
        kernels.space_similarity_residuals.address,
        kernels.space_similarity_fit.address,
    )


PLANE_SIMILARITY = CompiledModel(
    "similarity", 2, 4, 4, error_dof=2, freedom=4, solve_cost=60, load=_load_plane
)
SPACE_SIMILARITY = CompiledModel(
    "similarity", 3, 6, 8, error_dof=3, freedom=7, solve_cost=500, load=_load_space
)


def fit_similarity(
    a: Array,
    b: Array,
    settings: RansacSettings,
    *,
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit b = s R a + t, with s > 0 and R a rotation.

    Parameters
    ----------
    a, b : (N, 2) or (N, 3), matched row by row; best first for PROSAC's order
    settings : the threshold is a distance in b, in the unit of b
    sigma : of a coordinate of b, of each match (N,) or of all; without it the errors seen give it
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        model (3, 3) or (4, 4): the matrix [[s R, t], [0, 1]].  cov in the plane (4, 4) of the tangent
        (turn, shift x, shift y, log scale), in space (7, 7) of (rotation, translation, log scale):
        R <- R Exp(w), t <- t + R v, s <- s exp(λ), with t where the matrix has it.

    Raises
    ------
    DataError
        for points that do not pair, are not finite, or are fewer than two (in space: three).
    UnderConstrainedError
        where all points of a side are one (in space: or all are on one line).

    Notes
    -----
    Least squares by Umeyama 1991, whose scale is for errors in b only.
    """
    columns = np.shape(a)[1] if np.ndim(a) == 2 else 0
    if columns not in {2, 3}:
        raise ShapeError(f"a similarity takes points (N, 2) or (N, 3); got {np.shape(a)}")
    model = PLANE_SIMILARITY if columns == 2 else SPACE_SIMILARITY
    if settings.backend != "own":
        raise ModelError(f"the backend {settings.backend} has no {model.name}; take backend='own'")
    a, b = paired_points(a, b, columns, model.sample_size, model.name)
    middle_a, middle_b, size_a, size_b = a.mean(axis=0), b.mean(axis=0), spread(a), spread(b)
    rows = np.column_stack([(a - middle_a) / size_a, (b - middle_b) / size_b])
    inside = replace(settings, threshold=settings.threshold / size_b)
    found = search(model, rows, inside, relative_weights(sigma, len(a)), rng)
    sigma2 = size_b**2 * found.variance(sigma, size_b)
    turned, scale, shift = _parts(found.model)
    scale *= size_b / size_a
    t = middle_b + size_b * shift - scale * turned @ middle_a
    whole = np.eye(columns + 1)
    whole[:columns, :columns], whole[:columns, columns] = scale * turned, t
    return result_of(found, whole, sigma2 * _covariance(a, found, scale), scale=size_b)


def _parts(model: Array) -> tuple[Array, float, Array]:
    """Rotation, scale and shift of a model of the loop."""
    if len(model) == 4:
        p, q, scale = model[0], model[1], float(np.hypot(model[0], model[1]))
        return np.array([[p, -q], [q, p]]) / scale, scale, model[2:]
    w, x, y, z = model[:4]
    turned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return turned, float(model[7]), model[4:7]


def _covariance(a: Array, found: Found, scale: float) -> Array:
    """In the tangent, for errors of unit sigma: turned back into the frame of a, nothing depends on R."""
    n, k = a.shape
    turns = 1 if k == 2 else 3
    slope = np.zeros((n, k, turns + k + 1))
    if k == 2:
        slope[:, 0, 0], slope[:, 1, 0] = -scale * a[:, 1], scale * a[:, 0]
    else:
        x, y, z = scale * a.T
        slope[:, 0, 1], slope[:, 0, 2], slope[:, 1, 0] = z, -y, -z
        slope[:, 1, 2], slope[:, 2, 0], slope[:, 2, 1] = x, y, -x
    slope[:, :, turns : turns + k] = np.eye(k)
    slope[:, :, -1] = scale * a
    information = np.einsum("nki,n,nkj->ij", slope, found.weights, slope)
    return np.asarray(np.linalg.inv(information))
