"""What a robust fit is told: how far is too far, how sure to be, how long to try, and by whose means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sequential.errors import ModelError

__all__ = ["DEFAULT", "OPENCV_METHODS", "RansacSettings"]

OPENCV_METHODS = (
    "RANSAC",
    "LMEDS",
    "RHO",
    "USAC_DEFAULT",
    "USAC_PARALLEL",
    "USAC_FM_8PTS",
    "USAC_FAST",
    "USAC_ACCURATE",
    "USAC_PROSAC",
    "USAC_MAGSAC",
)


@dataclass(frozen=True, slots=True)
class RansacSettings:
    """Settings of every robust fit.

    Attributes
    ----------
    threshold : largest error of an inlier, in the unit of the model's error (each fit names it: px for a
        homography).  Some three to four standard deviations of the noise; larger does little harm with
        `refine="mixture"`
    confidence : probability that at least one sample was free of outliers when the search stops early
    max_iterations : samples at most that give a model to try; a homography's degenerate ones are drawn again,
        up to twenty times as many
    score : "msac" adds up truncated squares, "count" counts outliers
    method : "ransac", or "lmeds" which needs no threshold but more inliers than outliers
    order : "prosac" where rows come best first: the best are tried first
    local_optimisation : improve each best sample by least squares on the rows that agree
    inner_samples : random subsets of those rows to fit as well, each time
    refine : the last fit, by truncated least squares ("msac"), or with each row weighed by how probably it is
        no chance agreement ("mixture", which estimates the noise as it goes)
    backend : "own", "opencv" or "poselib" (an extra) do the search
    opencv_method : which of OpenCV's, by its name there
    """

    threshold: float = 3.0
    confidence: float = 0.999
    max_iterations: int = 100_000
    score: Literal["msac", "count"] = "msac"
    method: Literal["ransac", "lmeds"] = "ransac"
    order: Literal["as given", "prosac"] = "as given"
    local_optimisation: bool = True
    inner_samples: int = 0
    refine: Literal["mixture", "msac"] = "mixture"
    backend: Literal["own", "opencv", "poselib"] = "own"
    opencv_method: str = "RANSAC"

    def __post_init__(self) -> None:
        """Meet what cannot be meant.

        Raises
        ------
        ModelError
            for a threshold, confidence or number of iterations out of range, or a word that is not known.
        """
        if not self.threshold > 0.0:
            raise ModelError(f"threshold is the largest error of an inlier, above 0; got {self.threshold}")
        if not 0.0 < self.confidence < 1.0:
            raise ModelError(f"confidence lies between 0 and 1, as 0.999; got {self.confidence}")
        if self.max_iterations < 1:
            raise ModelError(f"max_iterations is at least 1; got {self.max_iterations}")
        for name, known in (
            ("score", ("msac", "count")),
            ("method", ("ransac", "lmeds")),
            ("order", ("as given", "prosac")),
            ("refine", ("mixture", "msac")),
            ("backend", ("own", "opencv", "poselib")),
            ("opencv_method", OPENCV_METHODS),
        ):
            if getattr(self, name) not in known:
                raise ModelError(f"{name} is one of {', '.join(known)}; got {getattr(self, name)!r}")


DEFAULT = RansacSettings()
