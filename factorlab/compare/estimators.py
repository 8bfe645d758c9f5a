"""The estimators by the names that tables, JSON and the command line use."""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches
from typing import NamedTuple

from sequential import (
    ExtendedKalmanFilter,
    IteratedExtendedKalmanFilter,
    IteratedSmoother,
    KalmanFilter,
    RauchTungStriebel,
)
from sequential.errors import ModelError
from sequential.run import Estimator

__all__ = ["EVERY_NAME", "KINDS", "NAMES", "Kind", "UnknownEstimatorError", "make", "require_names"]


class Kind(NamedTuple):
    """What a row of the table says about its estimator."""

    title: str
    online: bool = False  # an estimate at t uses readings up to t only
    graph: bool = False


KINDS = {
    "kf": Kind("Kalman filter", online=True),
    "kf_rts": Kind("Kalman filter + RTS"),
    "ekf": Kind("EKF", online=True),
    "iekf": Kind("iterated EKF", online=True),
    "ukf": Kind("UKF", online=True),
    "ekf_rts": Kind("EKF + RTS"),
    "ieks": Kind("iterated smoother"),
    "fixed_lag": Kind("fixed lag 5.5 s", online=True, graph=True),
    "isam2": Kind("iSAM2, online", online=True, graph=True),
    "isam2_final": Kind("iSAM2, at the end", graph=True),
    "batch": Kind("batch graph", graph=True),
}
LINEAR = ("kf", "kf_rts")  # for linear models only
NAMES = tuple(name for name in KINDS if name not in LINEAR)
EVERY_NAME = tuple(KINDS)


class UnknownEstimatorError(ModelError):
    """A name that no estimator has."""


def require_names(
    names: tuple[str, ...], known: tuple[str, ...] = EVERY_NAME, what: str = "estimator"
) -> tuple[str, ...]:
    """The names, once each; `UnknownEstimatorError` for one that is not `known`."""
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}"
            msg = f"no {what} is called {name!r}; {hint}"
            raise UnknownEstimatorError(msg)
    if not names:
        msg = f"a comparison needs an estimator; there are {', '.join(known)}"
        raise UnknownEstimatorError(msg)
    return tuple(dict.fromkeys(names))


def make(name: str) -> Estimator:
    """The estimator of a name, as a comparison uses it; gtsam is imported for graphs only."""
    if KINDS[name].graph:
        from factorlab.graph import BatchGraph, FixedLagGraph, IncrementalGraph

        if name == "fixed_lag":
            return FixedLagGraph(lag=5.5)
        return BatchGraph() if name == "batch" else IncrementalGraph(final=name == "isam2_final")
    if name == "ukf":
        from sequential import UnscentedKalmanFilter

        return UnscentedKalmanFilter()
    recursive: dict[str, Callable[[], Estimator]] = {
        "kf": KalmanFilter,
        "kf_rts": lambda: RauchTungStriebel(KalmanFilter()),
        "ekf": ExtendedKalmanFilter,
        "iekf": IteratedExtendedKalmanFilter,
        "ekf_rts": RauchTungStriebel,
        "ieks": IteratedSmoother,
    }
    return recursive[name]()
