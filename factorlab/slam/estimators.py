"""The estimators of SLAM problems by the names that tables, JSON and the command line use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Protocol

from factorlab.compare.estimators import require_names as known_names
from sequential.slam import SlamProblem, SlamRun

__all__ = ["KINDS", "NAMES", "Kind", "SlamEstimator", "make", "require_names"]

LAG_STEPS = 20


class SlamEstimator(Protocol):
    """Anything that solves a `SlamProblem`."""

    def solve(self, problem: SlamProblem) -> SlamRun:
        """Values, covariances and a report."""
        ...


class Kind(NamedTuple):
    """What a row says about its estimator.

    `solves` names the pass that gives the row: iSAM2's online and final rows come from one.
    """

    title: str
    solves: str
    part: Literal["online", "final"]
    latency: str  # which later readings an estimate waits for


KINDS = {
    "ekf_slam": Kind("EKF-SLAM", "ekf_slam", "online", "none"),
    "fixed_lag": Kind("fixed lag, online", "fixed_lag", "online", "none"),
    "isam2": Kind("iSAM2, online", "isam2", "online", "none"),
    "isam2_final": Kind("iSAM2, at the end", "isam2", "final", "whole log"),
    "batch": Kind("batch graph", "batch", "final", "whole log"),
    "batch_robust": Kind("batch graph, Cauchy loss", "batch_robust", "final", "whole log"),
    "gnc": Kind("batch graph, GNC", "gnc", "final", "whole log"),
}
NAMES = tuple(KINDS)


def require_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names, once each.

    Raises
    ------
    UnknownEstimatorError
        for a name that no estimator of SLAM problems has.
    """
    return known_names(names, NAMES, "estimator of SLAM problems")


def make(
    name: str,
    options: Mapping[str, Any],
    lag: float = LAG_STEPS,
    *,
    covariance: bool | tuple[str, ...] = True,
    every: int = 1,
) -> SlamEstimator:
    """The estimator behind a pass.

    Parameters
    ----------
    options : a dataset's, for its batch graphs
    lag : steps of a window
    every : steps between relinearisations of iSAM2
    covariance : kinds whose marginals are wanted; online ones of the newest pose with True only
    """
    if name == "ekf_slam":
        from sequential.slam import EkfSlam

        return EkfSlam()
    from factorlab.graph.slam import BatchSlam, FixedLagSlam, IncrementalSlam
    from sequential.model import Loss

    online = covariance is True
    if name == "fixed_lag":
        return FixedLagSlam(lag=lag, online=online)
    if name == "isam2":
        return IncrementalSlam(every=every, online=online, covariance=covariance)
    if name == "gnc":
        from factorlab.graph.slam.gnc import GncSlam

        return GncSlam(covariance=covariance)
    loss = Loss("cauchy", 2.385) if name == "batch_robust" else None
    return BatchSlam(**options, loss=loss, covariance=covariance)
