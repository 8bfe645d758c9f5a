"""What waiting is worth: a fixed-lag smoother at several lags, between the filter and the batch.

A window helps in two ways that are easily taken for one.  Its newest estimate waits for nothing, and is a
filter's with a past that can still be linearised anew; its oldest is `lag` seconds late and has seen what
came since.  Both are scored here, at every lag.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from factorlab.compare.accuracy import Errors
from factorlab.compare.axes import AxisErrors
from factorlab.compare.resources import kilobytes
from sequential.errors import FactorlabError, ModelError, NotPositiveDefiniteError
from sequential.history import Run

__all__ = ["Lag", "lag_sweep"]

BothRuns = Callable[[float], tuple[Run, Run]]


@dataclass(frozen=True, slots=True, eq=False)
class Lag:
    """A window of `lag_s` seconds.  A solve that failed has a message and no figures.

    `anees_per_dof` is the mean normalised error over its expectation, 1 for an honest estimate;
    `online_rmse` and `online_anees_per_dof` are those of the newest estimate of each window.
    """

    lag_s: float
    rmse: float | None = None
    anees_per_dof: float | None = None
    online_rmse: float | None = None
    online_anees_per_dof: float | None = None
    us_per_measurement: float | None = None
    slowest_update_ms: float | None = None
    states_kept: int | None = None
    memory_kb: float | None = None
    message: str = ""
    axes: AxisErrors | None = None  # of the delayed estimate

    def to_json(self) -> dict[str, Any]:
        """Plain numbers under the names of the fields."""
        plain = {name: getattr(self, name) for name in self.__slots__ if name != "axes"}
        return plain | {"axes": None if self.axes is None else self.axes.to_json()}


def lag_sweep(
    solve: BothRuns,
    errors: Callable[[Run], Errors | None],
    lags: Sequence[float],
    readings: int,
    axes: Callable[[Run], AxisErrors | None] = lambda _run: None,
) -> tuple[Lag, ...]:
    """Score windows of several lengths.

    Parameters
    ----------
    solve : lag in seconds -> what was known at each node at once, and `lag` seconds later, such as
        `lambda lag: FixedLagSmoother(lag).solve_both(problem)`
    errors, axes : of a run, against whatever there is
    lags : s, zero or more
    readings : that the time of a solve is divided by

    Raises
    ------
    ModelError
        for a negative lag.
    """
    if bad := [lag for lag in lags if not lag >= 0]:
        msg = f"a lag is a time in seconds, zero or more; got {bad[0]:g}"
        raise ModelError(msg)
    return tuple(_lag(solve, errors, lag, readings, axes) for lag in sorted(set(lags)))


def _lag(
    solve: BothRuns,
    errors: Callable[[Run], Errors | None],
    lag: float,
    readings: int,
    axes: Callable[[Run], AxisErrors | None],
) -> Lag:
    try:
        online, late = solve(lag)
    except FactorlabError as error:
        return Lag(lag, message=" ".join(str(error).split()))
    report = late.report
    widest = round(report.details.get("widest_window", 0))
    return Lag(
        lag,
        *_scores(errors(late)),
        *_scores(errors(online)),
        us_per_measurement=1e6 * report.seconds / max(readings, 1),
        slowest_update_ms=1e3 * report.details.get("slowest_update_s", float("nan")),
        states_kept=widest or None,
        memory_kb=kilobytes(late.manifold, widest) if widest else None,
        axes=axes(late),
    )


def _scores(errors: Errors | None) -> tuple[float | None, float | None]:
    """RMSE, and the normalised error over its expectation."""
    if errors is None:
        return None, None
    try:
        return errors.rmse(), float(errors.normalised().mean()) / errors.error.shape[1]
    except NotPositiveDefiniteError:
        return errors.rmse(), None
