"""The motion between two pictures of calibrated cameras, from matched pixels.

    view = estimate_two_view(camera_a, camera_b, pixels_a, pixels_b)
    view.verdict, view.b_T_a, view.cov, view.inliers

Essential matrix, homography and rotation are all searched for; each motion that one of them stands for is
refined on every pair, and the best kept.  So a plane that holds most of the pairs does not hide what the
others say.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Array, Camera
from vision3d.ray_pairs import ray_pairs
from vision3d.two_view.motion import essential_matrix, ray_depths
from vision3d.two_view.readings import Readings, read_pairs
from vision3d.two_view.result import TwoView, nothing
from vision3d.two_view.selection import CHANCE_LOG10, log10_false_alarms
from vision3d.two_view.stories import Told, tell

__all__ = ["estimate_two_view"]

FEWEST, MAX_SAMPLES = 8, 20_000
THRESHOLD_PX, THRESHOLD_SIGMAS = 1.0, 3.0


def estimate_two_view(
    camera_a: Camera,
    camera_b: Camera,
    pixels_a: Array,
    pixels_b: Array,
    *,
    sigma_px: Any = None,
    threshold_px: float | None = None,
    best_first: bool = False,
    max_samples: int = MAX_SAMPLES,
    rng: np.random.Generator | None = None,
) -> TwoView:
    """Find how camera b stands to camera a, up to the length of the translation.

    Parameters
    ----------
    camera_a, camera_b : that took the pictures, lens distortion included
    pixels_a, pixels_b : (N, 2) matched pixels, wrong matches among them
    sigma_px : standard deviation of a coordinate: one number, (N,) for both sides, or (N, 2) for a and b;
        None: one number, from the residuals
    threshold_px : Sampson distance up to which a pair agrees; None: 3 sigmas, or 1 px where sigma is unknown
    best_first : the pixels are sorted, surest matches first, and samples are drawn from those first (PROSAC)
    max_samples : of five pairs, at most
    rng : of the search; None: the same every time

    Raises
    ------
    ShapeError, NotFiniteError
        where the pixels are not as many, or not finite.
    """
    rng = np.random.default_rng(0) if rng is None else rng
    relative, level = _relative(sigma_px)
    threshold = threshold_px or (THRESHOLD_PX if level is None else THRESHOLD_SIGMAS * level)
    every, seen = ray_pairs(camera_a, camera_b, pixels_a, pixels_b, relative)
    rows = np.ascontiguousarray(every[seen])
    if len(rows) < FEWEST:
        words = (
            f"{len(rows)} matches with a ray in both cameras, and {FEWEST} are the fewest to tell a motion "
            "from chance: match more features, or look whether the cameras are those of the pictures"
        )
        return nothing("too few", words, len(seen), 0, np.inf)
    readings = read_pairs(rows, threshold, camera_b.size, rng, budget=max_samples, best_first=best_first)
    chance, by_chance = _by_chance(readings, camera_b.size)
    if chance > CHANCE_LOG10:
        words = (
            f"the best motion has {by_chance} of {len(rows)} pairs, as many as chance brings: the pictures "
            "do not overlap, show the same thing too differently, or their matches are wrong"
        )
        return nothing("no overlap", words, len(seen), readings.trials, chance)
    return _in_order_of_matches(tell(readings, level), readings, seen, chance)


def _by_chance(readings: Readings, size: tuple[int, int]) -> tuple[float, int]:
    """Expected number of readings as good by chance, log10, and its pairs: of whichever reading is surest."""
    return min(
        log10_false_alarms(readings.motion_squared, 5, 10, size),
        log10_false_alarms(readings.homography_squared, 4, 1, size, dims=2),
        log10_false_alarms(readings.rotation_squared, 2, 1, size, dims=2),
    )


def _in_order_of_matches(told: Told, readings: Readings, seen: NDArray[np.bool_], chance: float) -> TwoView:
    """The result over all matches, those without a ray among them."""
    rows, moved = readings.rows, bool(np.any(told.b_T_a[4:]))
    squared, inliers = np.full(len(seen), np.nan), np.zeros(len(seen), dtype=bool)
    points, E = np.full((len(seen), 3), np.nan), np.full((3, 3), np.nan)
    squared[seen], inliers[seen] = told.squared, told.agree
    if moved:
        E = essential_matrix(told.b_T_a)
        points[seen] = np.where(told.agree[:, None], _midpoints(told.b_T_a, rows), np.nan)
    turned = rows[told.agree, :3] @ rotation_matrix(told.b_T_a[:4]).T
    across = np.linalg.norm(np.cross(turned, rows[told.agree, 3:6]), axis=1)
    return TwoView(
        told.b_T_a, told.cov, E, inliers, points, told.verdict, told.words, told.sigma, np.sqrt(squared),
        told.rivals, told.normal, float(np.median(np.arcsin(np.minimum(across, 1.0)))), readings.criterion,
        chance, readings.trials, readings.stopped,
    )  # fmt: skip


def _midpoints(b_T_a: Array, rows: Array) -> Array:
    """Points (N, 3) in a's frame halfway between the rays of each pair; NaN behind a camera."""
    along_a, along_b = ray_depths(b_T_a, rows[:, :3], rows[:, 3:6])
    on_a = along_a[:, None] * rows[:, :3]
    on_b = (along_b[:, None] * rows[:, 3:6] - b_T_a[4:]) @ rotation_matrix(b_T_a[:4])
    ahead = (along_a > 0.0) & (along_b > 0.0)
    return np.where(ahead[:, None], 0.5 * (on_a + on_b), np.nan)


def _relative(sigma_px: Any) -> tuple[Any, float | None]:
    """Sigmas over their median, and that median; ones and None where there are none."""
    if sigma_px is None:
        return 1.0, None
    sigma = np.asarray(sigma_px, dtype=np.float64)
    level = float(np.median(sigma)) if sigma.size else 1.0
    return sigma / level if level > 0.0 else sigma, level
