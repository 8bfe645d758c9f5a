"""What a robust fit gives back, whoever did the search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["RobustFit"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RobustFit:
    """A model, how sure it is, and which rows agree with it.

    Attributes
    ----------
    model : the model, in the shape that its fit names
    cov : its covariance, in the chart that its fit names; NaN where the rows leave it undetermined
    inliers : (N,) whether each row's error is below the threshold
    errors : (N,) each row's error, in the unit of the threshold
    sigma : standard deviation of one component of an inlier's error, estimated
    iterations : samples drawn, degenerate ones too; -1 where a backend does not say
    stopped : "confidence reached", "budget spent", "all agree", or "not said" by a backend
    score : mean of the truncated squared errors over threshold²: 0 is perfect, 1 says that nothing agrees
    threshold : that was applied
    backend : who searched: "own", "opencv RANSAC", "poselib" …
    note : what a reader should know of the data, as that they leave the model open; mostly empty
    """

    model: Array
    cov: Array
    inliers: NDArray[np.bool_]
    errors: Array
    sigma: float
    iterations: int
    stopped: str
    score: float
    threshold: float
    backend: str = "own"
    note: str = ""

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (self.model, self.cov, self.inliers, self.errors):
            array.flags.writeable = False

    @property
    def count(self) -> int:
        """How many rows agree."""
        return int(np.count_nonzero(self.inliers))

    @property
    def inlier_ratio(self) -> float:
        """The share of rows that agree."""
        return self.count / len(self.inliers)

    def __str__(self) -> str:
        """Say it in a line."""
        tried = "" if self.iterations < 0 else f" after {self.iterations} samples"
        return (
            f"{self.count} of {len(self.inliers)} agree within {self.threshold:.3g} "
            f"(sigma {self.sigma:.3g}); {self.stopped}{tried} ({self.backend})"
        )
