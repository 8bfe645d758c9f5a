"""What waiting is worth: a fixed-lag smoother at several lags, between the filter and the batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from factorlab.datasets.slam import SlamDataset
from factorlab.slam.estimators import make
from factorlab.slam.scores import Scores, scores_of
from sequential.errors import FactorlabError, ModelError
from sequential.history import Run

__all__ = ["LAGS", "LagPoint", "slam_lag_sweep"]

STEP_NS = 1_000_000_000  # a problem without times counts a second a step
LAGS = (2.0, 5.0, 10.0, 20.0, 50.0, 100.0)


@dataclass(frozen=True, slots=True)
class LagPoint:
    """A window of `lag` steps: the estimate of the newest pose, made while driving."""

    lag: float
    rmse: float | None
    anees_per_dof: float | None
    us_per_measurement: float | None
    message: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain numbers under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


def slam_lag_sweep(
    dataset: SlamDataset, lags: Sequence[float] = LAGS, stand_in: Run | None = None, seed: int = 0
) -> tuple[LagPoint, ...]:
    """Solve with windows of several lengths.

    Parameters
    ----------
    lags : steps of the window
    stand_in : what is scored against where the dataset has no truth, such as the batch's trajectory

    Raises
    ------
    ModelError
        for a lag that is not positive.
    """
    if bad := [lag for lag in lags if not lag > 0]:
        msg = f"a lag counts steps of the window, 1 or more; got {bad[0]:g} (lag 0 is a filter)"
        raise ModelError(msg)
    return tuple(_point(dataset, lag, stand_in, seed) for lag in sorted(set(lags)))


def _point(dataset: SlamDataset, lag: float, stand_in: Run | None, seed: int) -> LagPoint:
    try:
        run = make("fixed_lag", dataset.graph_options, lag).solve(dataset.problem)
    except FactorlabError as error:
        return LagPoint(lag, None, None, None, " ".join(str(error).split()))
    assert run.online is not None  # noqa: S101 - a fixed lag keeps what it believed
    path = run.online if dataset.problem.t is not None else replace(run.online, t=run.online.t * STEP_NS)
    scores: Scores | None = scores_of(dataset, path, stand_in, seed, "the batch")
    honest = None if scores is None else scores.honesty
    return LagPoint(
        lag,
        None if scores is None else scores.rmse,
        None if honest is None else honest.mean / honest.expected,
        1e6 * run.report.seconds / dataset.problem.count,
    )
