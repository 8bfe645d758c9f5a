"""How far two calibrations of one camera disagree, pixel by pixel, beyond a turn of the camera.

The same ray is sent through both; the turn between the two camera frames that aligns them best is taken
away, as no application could see it (mrcal's "projection differencing").  What is left is compared with what
the two calibrations say of their own uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.manifold.quaternion import quaternion_exp, rotate
from vision3d.calibrate.calibration import Calibration
from vision3d.calibrate.uncertainty import pixel_grid, ray_jacobians, turn_freed
from vision3d.camera import Camera

__all__ = ["DifferenceMap", "difference"]

Array = NDArray[np.float64]

STEPS = 20


@dataclass(frozen=True, eq=False)
class DifferenceMap:
    """Where the second camera puts what the first sees, over a grid of the image.

    Attributes
    ----------
    grid : tuple[int, int]
        Columns and rows.
    pixels : Array
        (N, 2), of the first camera, row by row.
    vectors : Array
        (N, 2) px, from there to where the second sees the same ray; NaN where one has no such ray.
    turn_rad : Array
        (3,), rotation vector from the first camera frame to the second that was taken away.
    expected_px : Array
        (N,), root mean square distance that the two uncertainties lead to expect; NaN if neither is known.
    rms_px, max_px : float
        Over the grid.
    sigmas : float
        Root mean square over the grid of the distance in units of `expected_px`: about 1 where the two agree
        within what they say of themselves; NaN if neither says anything.
    words : str
        The same in a sentence.
    """

    grid: tuple[int, int]
    pixels: Array
    vectors: Array
    turn_rad: Array
    expected_px: Array
    rms_px: float
    max_px: float
    sigmas: float
    words: str

    @property
    def distance_px(self) -> Array:
        """Length of the vectors, (N,)."""
        lengths: Array = np.linalg.norm(self.vectors, axis=1)
        return lengths

    @property
    def map_px(self) -> Array:
        """The same as an image (rows, columns)."""
        return self.distance_px.reshape(self.grid[1], self.grid[0])


def difference(
    a: Calibration | Camera,
    b: Calibration | Camera,
    *,
    freed_rotation: bool = True,
    grid: tuple[int, int] = (24, 18),
) -> DifferenceMap:
    """Compare two calibrations of one camera.

    Parameters
    ----------
    a, b : Calibration | Camera
        A camera alone, such as one read from a file, is taken to be exact.
    freed_rotation : bool
        Take away the turn that aligns the two best.
    grid : tuple[int, int]
        Columns and rows over the image.

    Raises
    ------
    DataError
        Images of different sizes, or no ray that both see.
    """
    one, two = _camera(a), _camera(b)
    if one.size != two.size:
        raise DataError(
            f"two calibrations of one camera have one image size, got {one.size[0]}×{one.size[1]} and "
            f"{two.size[0]}×{two.size[1]}; calibrate at one size, or scale one camera"
        )
    pixels = pixel_grid(one.size, grid)
    rays = one.unproject(pixels)
    if not np.isfinite(two.project(rays)).all(axis=1).any():
        raise DataError("no ray of the first camera has an image in the second: are they of the same camera?")
    weights = _weights(a, b, pixels, grid)
    turn = _turn(two, rays, pixels, weights) if freed_rotation else np.zeros(3)
    vectors = two.project(rotate(quaternion_exp(turn), rays)) - pixels
    expected = _expected(a, b, pixels, weights if freed_rotation else None, grid)
    distance = np.linalg.norm(vectors, axis=1)
    seen = np.isfinite(distance)
    rms = float(np.sqrt(np.mean(distance[seen] ** 2)))
    known = seen & np.isfinite(expected) & (expected > 0.0)
    sigmas = (
        float(np.sqrt(np.mean((distance[known] / expected[known]) ** 2))) if known.any() else float("nan")
    )
    words = _words(rms, float(distance[seen].max()), sigmas, turn)
    return DifferenceMap(
        grid, pixels, vectors, turn, expected, rms, float(distance[seen].max()), sigmas, words
    )


def _camera(one: Calibration | Camera) -> Camera:
    return one.camera if isinstance(one, Calibration) else one


def _weights(a: Calibration | Camera, b: Calibration | Camera, pixels: Array, grid: tuple[int, int]) -> Array:
    """Where the two are sure, the turn is fitted: inverse variances, (N,); equal where nothing is known."""
    variance = _expected(a, b, pixels, None, grid) ** 2
    if not np.isfinite(variance).any():
        return np.ones(len(pixels))
    # twice the least variance at most counts in full: certainty beyond that is of no use to a turn
    weights: Array = np.where(np.isfinite(variance), 1.0 / (variance + np.nanmin(variance)), 0.0)
    return weights


def _expected(
    a: Calibration | Camera,
    b: Calibration | Camera,
    pixels: Array,
    weights: Array | None,
    grid: tuple[int, int],
) -> Array:
    """Root mean square distance by the covariances of both, (N,); the turn freed where weights are given."""
    variance = np.zeros(len(pixels))
    known = False
    for one in (a, b):
        if not isinstance(one, Calibration):
            continue
        known = True
        by_turn, jacobian = ray_jacobians(one.camera, one.camera.unproject(pixels))
        if weights is not None:
            jacobian = jacobian - by_turn @ turn_freed(one.camera, weights, grid)
        variance += np.einsum("nij,jk,nik->n", jacobian, one.cov, jacobian)
    expected: Array = np.sqrt(variance) if known else np.full(len(pixels), np.nan)
    return expected


def _turn(camera: Camera, rays: Array, pixels: Array, weights: Array) -> Array:
    """Rotation vector that brings the images of the rays nearest to the pixels, by Gauss-Newton."""
    turn = np.zeros(3)
    for _ in range(STEPS):
        turned = rotate(quaternion_exp(turn), rays)
        off = pixels - camera.project(turned)
        by_turn = ray_jacobians(camera, turned)[0]
        seen = np.isfinite(off[:, 0]) & (weights > 0.0)
        w, J = weights[seen], by_turn[seen]
        step = np.linalg.solve(np.einsum("n,nij,nik->jk", w, J, J), np.einsum("n,nij,ni->j", w, J, off[seen]))
        # steps are turns of the turned rays: composed from the left, small enough to add
        turn = turn + step
        if np.linalg.norm(step) < 1e-12:
            break
    return turn


def _words(rms: float, largest: float, sigmas: float, turn: Array) -> str:
    angle = float(np.degrees(np.linalg.norm(turn)))
    told = f"the two differ by {rms:.2f} px (RMS over the image; at most {largest:.1f} px)"
    if angle > 0.0:
        told += f" once turned by {angle:.3f}°"
    if not np.isfinite(sigmas):
        return told
    verdict = "so they agree" if sigmas < 2.0 else "more than chance easily explains"
    if sigmas >= 3.0:
        verdict = "so one of them is wrong"
    return f"{told}: {sigmas:.1f}x what their uncertainties lead to expect, {verdict}"
