"""The motion, plane or rotation nearest to pairs of rays, by robust least squares, with its covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sequential.errors import ModelError, UnderConstrainedError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Array
from vision3d.two_view.motion import essential_matrix, motion

__all__ = [
    "LOSSES",
    "Refined",
    "homography_distances",
    "inflation",
    "inverted",
    "refine_homography_of",
    "refine_motion",
    "refine_plane",
    "refine_rotation",
    "sampson_distances",
]

LOSSES: Final = {"plain": 0, "huber": 1, "cauchy": 2, "truncated": 3}
ITERATIONS_MAX = 60
CONDITION_MAX = 1e13


@dataclass(frozen=True, slots=True)
class Refined:
    """What a refinement found.

    Parameters
    ----------
    parameters : a motion (7,), or R and t and n in a row (15,), or R (9,)
    cost : robust cost over all rows, in squared standard deviations
    information : (k, k) of the tangent, k = 5, 8 or 3, weighted by the loss
    iterations : of the solver
    """

    parameters: Array
    cost: float
    information: Array
    iterations: int


def refine_motion(
    rows: Array, b_T_a: Array, *, loss: str = "plain", scale: float = 1.0, iterations: int = ITERATIONS_MAX
) -> Refined:
    """Move b_T_a (7,) to the least robust cost of Sampson distances of rows (N, 18).

    `loss` is "plain", "huber", "cauchy" or "truncated", and `scale` its parameter in standard deviations.  No
    iterations: cost and information where it is.
    """
    from vision3d.kernels.essential import refine_essential

    R, t, information = rotation_matrix(b_T_a[:4]), np.array(b_T_a[4:]), np.empty((5, 5))
    R = np.ascontiguousarray(R)
    t /= np.linalg.norm(t)
    cost, made = refine_essential(rows, np.ones(len(rows)), _loss(loss), scale, iterations, R, t, information)
    return Refined(motion(R, t), cost, information, made)


def refine_plane(
    rows: Array,
    R: Array,
    t: Array,
    n: Array,
    *,
    loss: str = "plain",
    scale: float = 1.0,
    iterations: int = ITERATIONS_MAX,
) -> Refined:
    """The same for a plane seen after a motion, b ~ (R + t n') a, with t (3,) of any length."""
    length = float(np.linalg.norm(t))
    start = np.concatenate([np.ravel(R), np.asarray(t) / length, np.asarray(n) * length])
    return refine_homography_of(rows, start, 8, loss=loss, scale=scale, iterations=iterations)


def refine_rotation(
    rows: Array, R: Array, *, loss: str = "plain", scale: float = 1.0, iterations: int = ITERATIONS_MAX
) -> Refined:
    """The same for a camera that only turns, b ~ R a."""
    start = np.array(R, dtype=np.float64).ravel()
    return refine_homography_of(rows, start, 3, loss=loss, scale=scale, iterations=iterations)


def sampson_distances(rows: Array, b_T_a: Array) -> Array:
    """Squared Sampson distances (N,) of rows (N, 18) to a motion (7,), in standard deviations."""
    from vision3d.kernels.essential import essential_residuals

    squared = np.empty(len(rows))
    essential_residuals(rows, np.ascontiguousarray(essential_matrix(b_T_a).ravel()), squared)
    return squared


def homography_distances(rows: Array, H: Array) -> Array:
    """Squared Sampson distances (N,) of rows (N, 18) to a homography of rays (3, 3), of two coordinates."""
    from vision3d.kernels.ray_homography import homography_residuals

    squared = np.empty(len(rows))
    homography_residuals(rows, np.ascontiguousarray(np.ravel(H)), squared)
    return squared


def inflation(squared: Array, scale: float, dims: int = 1) -> float:
    """How much wider than the plain (H)⁻¹ the covariance of Cauchy's estimate is: E ψ² / (E ψ')².

    `squared` (N,) are squared distances of `dims` coordinates, in sigmas, as is `scale`.  Huber 1964, for any
    noise.
    """
    weight = 1.0 / (1.0 + squared / scale**2)
    psi2 = np.mean(weight**2 * squared) / dims
    slope = np.mean(weight - 2.0 / dims * weight**2 * squared / scale**2)
    return float(psi2 / slope**2) if slope > 0.0 else np.inf


def inverted(information: Array, what: str) -> Array:
    """Covariance of an information (k, k), scaled first: angles and lengths may differ by orders.

    Raises
    ------
    UnderConstrainedError
        where the pairs leave a direction free; `what` says of what.
    """
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(information), 1e-300))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    if not values[0] > values[-1] / CONDITION_MAX:
        raise UnderConstrainedError(f"the pairs do not determine {what}: a direction of it is free")
    cov: Array = ((vectors / values) @ vectors.T) * np.outer(scale, scale)
    return 0.5 * (cov + cov.T)


def refine_homography_of(
    rows: Array, start: Array, kind: int, *, loss: str, scale: float, iterations: int = ITERATIONS_MAX
) -> Refined:
    """The same for the parameters of a homography of rays; `kind` is 3, 8 or 9 (`kernels.ray_homography`)."""
    from vision3d.kernels.ray_homography import refine_homography

    parameters, information = np.array(start, dtype=np.float64), np.empty((kind, kind))
    cost, made = refine_homography(
        rows, np.ones(len(rows)), _loss(loss), scale, iterations, kind, parameters, information
    )
    return Refined(parameters, cost, information, made)


def _loss(name: str) -> int:
    if name not in LOSSES:
        raise ModelError(f"no loss {name!r}; known are {', '.join(LOSSES)}")
    return LOSSES[name]
