"""What a fundamental matrix tells of cameras nobody calibrated: projective cameras, and the focal lengths.

Two pictures fix two numbers besides the motion: a focal length each, if the principal points are known (the
middles of the pictures are near them) and the optical axes do not meet.  Where they meet, as when both
cameras look at one thing, the two cannot be told apart; where they are parallel, neither can be told at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sequential.manifold.so3 import skew
from vision3d.camera import Array, Camera
from vision3d.two_view.epipolar import epipoles

__all__ = ["FocalGuess", "cameras_from_fundamental", "common_focal", "focal_lengths", "projective_cameras"]

SURE: Final = 0.2
"""Standard deviation over value up to which a focal length counts as observed."""
STEP = 1e-6
RANGE: Final = (0.2, 20.0)
"""Focal lengths that are looked at, in lengths of the longer side of the picture."""


@dataclass(frozen=True, slots=True)
class FocalGuess:
    """A focal length from a fundamental matrix.

    Parameters
    ----------
    focal_px : NaN where no real one agrees with F
    sigma_px : its standard deviation from the covariance of F; NaN without one
    observable : whether that is below a fifth of the value
    """

    focal_px: float
    sigma_px: float
    observable: bool


def projective_cameras(F: Array) -> tuple[Array, Array]:
    """Projections (3, 4) with this F, known up to a common projective map: [I | 0] and [[e]x F | e].

    Hartley, Zisserman 2004, result 9.14.
    """
    _, e = epipoles(F)
    return np.eye(3, 4), np.column_stack([skew(e) @ F, e])


def focal_lengths(
    F: Array, centre_a: Array, centre_b: Array, cov: Array | None = None
) -> tuple[FocalGuess, FocalGuess]:
    """Focal lengths of both cameras, of square pixels and principal points (2,) px; cov (9, 9) is that of F.

    Bougnoux 1998, "From projective to Euclidean space under any practical situation".
    """

    def both(matrix: Array) -> Array:
        return np.array([_bougnoux(matrix, centre_a, centre_b), _bougnoux(matrix.T, centre_b, centre_a)])

    values, sigmas = _propagated(both, np.asarray(F, dtype=np.float64), cov)
    first, second = (_guess(float(values[k]), float(sigmas[k])) for k in range(2))
    return first, second


def common_focal(
    F: Array, centre_a: Array, centre_b: Array, cov: Array | None = None, *, longest_px: float = 1000.0
) -> FocalGuess:
    """The focal length that both pictures share: where the two singular values of K' F K are most alike.

    `longest_px` is the longer side of the pictures: focal lengths of 0.2 to 20 of it are looked at.
    """

    def one(matrix: Array) -> Array:
        return np.array([_alike(matrix, centre_a, centre_b, longest_px)])

    values, sigmas = _propagated(one, np.asarray(F, dtype=np.float64), cov)
    return _guess(float(values[0]), float(sigmas[0]))


def cameras_from_fundamental(
    F: Array, size_a: tuple[int, int], size_b: tuple[int, int], cov: Array | None = None
) -> tuple[Camera, Camera, FocalGuess]:
    """Pinholes of one focal length with their principal points in the middle: a start for what comes after.

    Where F does not tell the focal length, 1.2 times the longer side of the pictures is taken, and the guess
    says so by `observable`.
    """
    centres = [(np.array(size) - 1.0) / 2.0 for size in (size_a, size_b)]
    longest = float(max(*size_a, *size_b))
    guess = common_focal(F, centres[0], centres[1], cov, longest_px=longest)
    focal = guess.focal_px if guess.observable else 1.2 * longest
    a, b = (
        Camera("pinhole", (focal, focal, *centre), (), size)
        for centre, size in zip(centres, (size_a, size_b), strict=True)
    )
    return a, b, guess


def _bougnoux(F: Array, centre_a: Array, centre_b: Array) -> float:
    """The focal length of camera a; NaN where its square comes out negative."""
    _, e = epipoles(F)
    p, q = (np.append(centre, 1.0) for centre in (centre_a, centre_b))
    flat = np.diag([1.0, 1.0, 0.0])
    line = q @ skew(e) @ flat
    below = line @ F @ flat @ F.T @ q
    square = -(line @ F @ p) * (p @ F.T @ q) / below if below != 0.0 else np.nan
    return float(np.sqrt(square)) if square > 0.0 else np.nan


def _alike(F: Array, centre_a: Array, centre_b: Array, longest_px: float) -> float:
    """The focal length in RANGE of least difference of singular values; NaN where that is at an end."""
    from scipy.optimize import minimize_scalar

    def centred(centre: Array) -> Array:
        return np.array([[1.0, 0.0, centre[0]], [0.0, 1.0, centre[1]], [0.0, 0.0, 1.0]])

    G = centred(centre_b).T @ F @ centred(centre_a)

    def unlike(logarithm: float) -> float:
        K = np.diag([np.exp(logarithm), np.exp(logarithm), 1.0])
        first, second, _ = np.linalg.svd(K @ G @ K, compute_uv=False)
        return float((first - second) / (first + second))

    grid = np.log(longest_px) + np.linspace(np.log(RANGE[0]), np.log(RANGE[1]), 200)
    best = int(np.argmin([unlike(one) for one in grid]))
    if best in (0, len(grid) - 1):
        return np.nan
    found = minimize_scalar(
        unlike, bounds=(grid[best - 1], grid[best + 1]), method="bounded", options={"xatol": 1e-10}
    )
    return float(np.exp(found.x))


def _propagated(function: Callable[[Array], Array], F: Array, cov: Array | None) -> tuple[Array, Array]:
    """Values of F, and their standard deviations by central differences; NaN without a covariance."""
    values = function(F)
    if cov is None:
        return values, np.full(len(values), np.nan)
    # along what F really does, a standard deviation at a time: differences smaller than the noise mean little
    spreads, axes = np.linalg.eigh(cov)
    moves = (np.sqrt(np.maximum(spreads, 0.0)) * axes).T.reshape(-1, 3, 3)
    slopes = [
        (function(F + move) - function(F - move)) / 2.0
        for move in moves
        if np.linalg.norm(move) > STEP * 1e-6
    ]
    return values, np.sqrt(np.sum(np.square(slopes), axis=0))


def _guess(value: float, sigma: float) -> FocalGuess:
    told = np.isfinite(value) and (np.isnan(sigma) or sigma < SURE * value)
    return FocalGuess(value, sigma, bool(told))
