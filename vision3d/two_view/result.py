"""What two pictures tell of the motion between them, and how it is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vision3d.camera import Array
from vision3d.two_view.selection import Criterion

__all__ = ["TwoView", "Verdict", "nothing"]

Verdict = Literal["general", "planar", "pure rotation", "too few", "no overlap", "identical"]


@dataclass(frozen=True, slots=True, eq=False)
class TwoView:
    """The relative pose of two pictures, up to the length of its translation.

    Parameters
    ----------
    b_T_a : (7,) qw qx qy qz px py pz with a translation of length one; zero where the camera only turned, NaN
        where there is no motion
    cov : (5, 5) of rotation and direction in the chart of `retract_motion` (GTSAM's EssentialMatrix), rad²;
        (3, 3) block of the rotation alone where the camera only turned, the rest NaN
    essential : (3, 3), NaN where there is none
    inliers : (N,) bool
    points_a : (N, 3) in a's frame, in baselines; NaN where not triangulated
    verdict : "general", "planar", "pure rotation", "identical", "no overlap" or "too few"
    words : what that means and what to do
    sigma_px : noise of a coordinate of a pixel: the median of those given, or from the residuals
    residuals : (N,) Sampson distances to what the verdict says, px (of a match of median sigma, where each
        has its own); NaN without a ray
    rivals : other motions (M, 7) that explain the pairs as well: the second reading of a plane
    normal : (3,) of the plane in a's frame over its distance in baselines, NaN unless planar
    parallax_rad : median angle between the rays of inliers once the rotation is undone
    criterion : Torr's, of each model
    log10_nfa : expected number of motions as good by chance, log10
    trials : samples drawn
    stopped : why the search ended
    """

    b_T_a: Array
    cov: Array
    essential: Array
    inliers: NDArray[np.bool_]
    points_a: Array
    verdict: Verdict
    words: str
    sigma_px: float
    residuals: Array
    rivals: Array
    normal: Array
    parallax_rad: float
    criterion: Criterion | None
    log10_nfa: float
    trials: int
    stopped: str

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (
            self.b_T_a, self.cov, self.essential, self.inliers, self.points_a, self.residuals, self.rivals,
            self.normal,
        ):  # fmt: skip
            array.flags.writeable = False

    @property
    def known(self) -> bool:
        """Whether there is a rotation at all."""
        return bool(np.isfinite(self.b_T_a[:4]).all())


def nothing(verdict: Verdict, words: str, count: int, trials: int, log10_nfa: float) -> TwoView:
    """The result where no motion was found among `count` matches."""
    nan = np.nan
    return TwoView(
        np.full(7, nan), np.full((5, 5), nan), np.full((3, 3), nan), np.zeros(count, dtype=bool),
        np.full((count, 3), nan), verdict, words, nan, np.full(count, nan), np.empty((0, 7)), np.full(3, nan),
        nan, None, log10_nfa, trials, "no motion found",
    )  # fmt: skip
