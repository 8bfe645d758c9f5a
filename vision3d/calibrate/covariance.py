"""The covariance of a calibration: as independent corners have it, and as the views show it to be.

The inverse of the information matrix is honest if the errors of corners are independent.  On real images they
are not: a board that is not quite flat, a lens that is not quite the model, blur and light move the corners
of one view together, and the stated deviations come out two to three times too small.  Views, however, are
independent of each other; so the scatter of what each view asks for, its score, tells the truth: the
"sandwich" of Liang and Zeger 1986 ("Longitudinal data analysis using generalized linear models") with the
views for clusters, the leverage of each corrected as in Bell and McCaffrey 2002 ("Bias reduction in standard
errors for linear regression with multi-stage samples").  Few views tell a scatter badly, so it is drawn
towards the information matrix times one factor; and where the factor is what chance explains, it is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.descent import Blocks, schur

__all__ = ["Covariances", "covariances", "reduced"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CHANCE = 3.0
"""Standard deviations by which the scatter must exceed that of independent corners to be believed."""
LEVERAGE_MAX = 0.98
"""A view that decides a direction almost alone says nothing of its scatter there."""


@dataclass(frozen=True, eq=False)
class Covariances:
    """Of θ = (parameters, warp) and of poses; rows and columns of what was held are zero.

    Attributes
    ----------
    joint : Array
        (q, q), with the scatter of the views where it exceeds that of independent corners.
    independent : Array
        (q, q), the scaled inverse of the information matrix.
    pose_alone, pose_follows : Array
        (V, 6, 6) of poses when θ is known; (V, 6, q) how they follow θ.
    inflation : float
        Standard deviations in `joint` over those in `independent`, root of the mean square; 1 where the
        scatter is what chance explains.
    condition : float
        Of the information matrix at unit diagonal.
    weakest : Array
        (q,), the unit vector of θ, at unit diagonal, that the views tell least about.
    """

    joint: Array
    independent: Array
    pose_alone: Array
    pose_follows: Array
    inflation: float
    condition: float
    weakest: Array


def covariances(blocks: Blocks, free: Mask, scale: float, groups: NDArray[np.int64]) -> Covariances:
    """Covariances at a minimum.

    Parameters
    ----------
    blocks : Blocks
        Normal equations there, weighted by 1 / sigma².
    free : Mask
        What was estimated of θ, (q,).
    scale : float
        Standard deviation of the residuals in units of sigma.
    groups : NDArray[np.int64]
        Number of the group of every view, (V,): views of one group err alike.
    """
    S, _, T_inverse, Y = schur(blocks, free)
    sizes = 1.0 / np.sqrt(np.maximum(np.diag(S), 1e-300))
    values, vectors = np.linalg.eigh(S * sizes[:, None] * sizes)
    values = np.maximum(values, 1e-15 * values[-1])
    # columns of `root` are a basis in which the information matrix is the identity
    root = sizes[:, None] * vectors / np.sqrt(values)
    scatter, inflation = _scatter(blocks, free, Y, root / scale, groups)
    joint, independent = scale**2 * root @ scatter @ root.T, scale**2 * root @ root.T
    weakest = np.zeros(len(free))
    weakest[free] = vectors[:, 0]
    follows = np.zeros((len(Y), 6, len(free)))
    follows[:, :, free] = Y
    return Covariances(
        _spread(joint, free),
        _spread(independent, free),
        (scale * inflation) ** 2 * T_inverse,
        follows,
        inflation,
        float(values[-1] / values[0]),
        weakest,
    )


def _scatter(
    blocks: Blocks, free: Mask, Y: Array, root: Array, groups: NDArray[np.int64]
) -> tuple[Array, float]:
    """Covariance of the estimate in the basis in which independent corners give the identity; inflation."""
    information, scores = reduced(blocks, free, Y)
    f, V = int(free.sum()), int(groups.max()) + 1
    together = np.eye(V)[:, groups]
    # `root` carries scores to unit variance, and information to scale² times the identity in all
    shares = np.einsum("gv,vij->gij", together, root.T @ information @ root)
    shares /= np.trace(shares.sum(axis=0)) / f
    scores = together @ scores @ root
    identity = np.eye(f)
    values, vectors = np.linalg.eigh(0.5 * (shares + shares.transpose(0, 2, 1)))
    seen = np.clip(values, 0.0, LEVERAGE_MAX)
    turned = np.einsum("vij,vi->vj", vectors, scores) / np.sqrt(1.0 - seen)
    scores = np.einsum("vij,vj->vi", vectors, turned)
    scatter = scores.T @ scores
    factor = float(np.trace(scatter)) / f
    chance = np.sqrt(2.0 * np.sum(seen**2)) / f
    if factor <= 1.0 + CHANCE * chance:
        return identity, 1.0
    share = V / (V + f + 1.0)
    blended: Array = share * scatter + (1.0 - share) * factor * identity
    return blended, float(np.sqrt(factor))


def reduced(blocks: Blocks, free: Mask, Y: Array) -> tuple[Array, Array]:
    """Information (V, f, f) and scores (V, f) of every view about what is free, its pose eliminated."""
    information = blocks.U[:, free][:, :, free] + blocks.W[:, free] @ Y
    return information, blocks.a[:, free] + np.einsum("vip,vi->vp", Y, blocks.b)


def _spread(matrix: Array, free: Mask) -> Array:
    """Put a matrix of the free parameters among zeros."""
    whole = np.zeros((len(free), len(free)))
    whole[np.ix_(free, free)] = 0.5 * (matrix + matrix.T)
    return whole
