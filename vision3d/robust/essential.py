"""Robust fit of an essential matrix to rays, or to normalised points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError, SolverError
from vision3d.ray_pairs import pairs_of_points, pairs_of_rays
from vision3d.robust.backends import NOT_SAID, Outside, opencv_method, poselib_options, seed_of, the_poselib
from vision3d.robust.covariance import pseudo_inverse
from vision3d.robust.rays import ESSENTIAL
from vision3d.robust.result import RobustFit
from vision3d.robust.search import Found, assess, relative_weights, result_of, search
from vision3d.robust.settings import RansacSettings

__all__ = ["fit_essential", "fit_essential_rows"]

Array = NDArray[np.float64]
DEFAULT_THRESHOLD = 0.002
FEWEST = 6


def fit_essential(
    a: Array,
    b: Array,
    settings: RansacSettings | None = None,
    *,
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit E of matched unit rays (N, 3), or normalised points (N, 2): b' E a = 0.

    Parameters
    ----------
    a, b : (N, 3) rays of one camera each, or (N, 2) x/z and y/z; best first for PROSAC's order
    settings : the threshold is a Sampson distance, in rad between rays or in the unit of the points (px over
        the focal length); by default 0.002
    sigma : of a coordinate in that unit, of each match (N,) or of all; without it the covariance is scaled by
        the errors seen
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        model (3, 3) with singular values 1, 1, 0, of either sign; cov (9, 9) of its elements row by row, of
        rank 5.  `vision3d.two_view.estimate_two_view` goes on from matched pixels to the motion.

    Raises
    ------
    DataError
        for matches that do not pair, are not finite, or are fewer than six.
    UnderConstrainedError
        where no five of them determine an essential matrix.
    """
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    rows = pairs_of_points(a, b) if a.ndim == 2 and a.shape[1] == 2 else pairs_of_rays(a, b)
    settings = RansacSettings(DEFAULT_THRESHOLD) if settings is None else settings
    return fit_essential_rows(rows, settings, sigma=sigma, rng=rng)


def fit_essential_rows(
    rows: Array,
    settings: RansacSettings,
    *,
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """The same for rows (N, 18) of `vision3d.ray_pairs`, whose noise may differ with place and direction."""
    if len(rows) < FEWEST:
        raise DataError(f"an essential matrix takes {FEWEST} matches or more; got {len(rows)}")
    weights = relative_weights(sigma, len(rows))
    if settings.backend == "own":
        found = search(ESSENTIAL, rows, settings, weights, rng)
    else:
        outside = _outside(rows, settings, rng)
        found = assess(ESSENTIAL, rows, settings, weights, outside.model.ravel(), outside)
    E = found.model.reshape(3, 3)
    cov = found.variance(sigma) * _inverse_information(rows, found)
    return result_of(found, E * (np.sqrt(2.0) / np.linalg.norm(E)), cov)


def _inverse_information(rows: Array, found: Found) -> Array:
    """The covariance (9, 9) of the elements for errors of unit sigma."""
    from vision3d.kernels.essential import essential_information

    H, D = np.empty((5, 5)), np.empty((5, 9))
    if not essential_information(rows, found.weights, found.model, H, D):
        return np.full((9, 9), np.nan)
    return np.asarray(D.T @ pseudo_inverse(H, np.empty((0, 5))) @ D)


def _outside(rows: Array, settings: RansacSettings, rng: np.random.Generator | None) -> Outside:
    """What OpenCV or PoseLib finds on normalised points."""
    if not (rows[:, [2, 5]] > 1e-3).all():
        raise ModelError("OpenCV and PoseLib take rays ahead of the image plane only; take backend='own'")
    a, b = rows[:, :2] / rows[:, 2:3], rows[:, 3:5] / rows[:, 5:6]
    # a threshold of rows is one of normalised points where noise is
    unit = float(np.median(np.linalg.norm(rows[:, 6:].reshape(-1, 6, 2), axis=1)) / np.sqrt(2.0))
    work = {"opencv": _opencv, "poselib": _poselib}[settings.backend]
    found = work(a, b, settings.threshold * unit, settings, seed_of(rng))
    if not np.isfinite(found.model).all():
        raise SolverError(f"{found.backend} found no essential matrix among {len(rows)} matches")
    return found


def _opencv(a: Array, b: Array, threshold: float, settings: RansacSettings, seed: int) -> Outside:
    import cv2

    method, name = opencv_method(settings)
    if name == "RHO":
        raise ModelError("OpenCV's RHO knows homographies only; take another opencv_method")
    cv2.setRNGSeed(seed)
    E, _ = cv2.findEssentialMat(a, b, np.eye(3), method, settings.confidence, threshold)
    # several solutions come stacked where five pairs are all there is
    found = np.full((3, 3), np.nan) if E is None or len(E) < 3 else np.asarray(E[:3], dtype=np.float64)
    return Outside(found, -1, NOT_SAID, f"opencv {name}")


def _poselib(a: Array, b: Array, threshold: float, settings: RansacSettings, seed: int) -> Outside:
    camera = {"model": "SIMPLE_PINHOLE", "width": 1, "height": 1, "params": [1.0, 0.0, 0.0]}
    options = poselib_options(settings, seed, "max_epipolar_error") | {"max_epipolar_error": threshold}
    found, told = the_poselib().estimate_relative_pose(a, b, camera, camera, options, {})
    R, t = np.asarray(found.R), np.asarray(found.t)
    E = np.cross(np.eye(3), t / np.linalg.norm(t)).T @ R
    return Outside(E, int(told["iterations"]), NOT_SAID, "poselib")
