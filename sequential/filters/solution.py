"""From the arrays that a kernel wrote to the `Run` that a user reads."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.compile import Compiled
from sequential.errors import NotFiniteError, NotPositiveDefiniteError
from sequential.history import Innovations, Prediction, Report, Run
from sequential.timeline import Problem

__all__ = [
    "allocate",
    "as_run",
    "collect_innovations",
    "finished",
    "masked",
    "require_finite",
    "require_solved",
]


def allocate(problem: Problem, tables: Any, *, keep: bool) -> tuple[Any, ...]:
    """Arrays in the order of the kernels' `Filtered` record, of which the last is of integers.

    All are cut from one block: the memory of a log's results then goes back to the allocator as one piece and
    comes back as one, without the page faults that cost more than the filter.
    """
    nodes, readings = len(problem.t), len(problem.reading_t)
    n, d, widest = tables.n, tables.d, problem.schedule.z.shape[1]
    kept = nodes if keep else 1
    shapes = ((nodes, n), (nodes, d, d), (kept, n), (kept, d, d), (kept, d, d), (readings, widest))
    *floats, accepted = cut((*shapes, (readings, widest, widest), (readings,)))
    return (*floats, accepted.view(np.int64))


def cut(shapes: tuple[tuple[int, ...], ...]) -> list[NDArray[np.float64]]:
    """Arrays of these shapes, not filled, side by side in one block."""
    sizes = [math.prod(shape) for shape in shapes]
    block, pieces, end = np.empty(sum(sizes)), [], 0
    for size, shape in zip(sizes, shapes, strict=True):
        pieces.append(block[end : end + size].reshape(shape))
        end += size
    return pieces


def require_solved(problem: Problem, failed: int, filtered: Any = None) -> None:
    """Raise where a kernel stopped: `failed` is -1, the reading it stopped at, or -2 minus the node.

    Raises
    ------
    NotFiniteError
        where a model function returned NaN; needs the kernel's arrays.
    NotPositiveDefiniteError
        where a covariance was not positive definite.
    """
    if failed == -1:
        return
    if failed < 0:
        node = -2 - failed
        what, when = "the predicted covariance", problem.t[node] * 1e-9
        where = f"at {when:.6f} s"
    else:
        node = int(np.searchsorted(problem.t, problem.reading_t[failed]))
        name = list(problem.model.sensors)[problem.schedule.sensor[failed]]
        what, when = f"the innovation covariance of {name!r}", problem.reading_t[failed] * 1e-9
        where = f"at {when:.6f} s (reading {problem.reading_row[failed]})"
    if filtered is not None:
        seen = [filtered.mean[node], filtered.cov[node]]
        if failed >= 0:
            seen += [filtered.residual[failed], filtered.residual_cov[failed]]
        if not all(np.isfinite(values).all() for values in seen):
            raise NotFiniteError(
                f"{what} is not finite {where}: a model function returned NaN or infinity there, or the "
                "state diverged; evaluate step and observe at the estimate before it"
            )
    raise NotPositiveDefiniteError(
        f"{what} is not positive definite {where}: the state has diverged, or noise_cov is far below the "
        "rounding of the predicted covariance; widen the prior or the noise"
    )


def require_finite(problem: Problem, mean: np.ndarray) -> None:
    """Raise `NotFiniteError` where an estimate is not finite."""
    finite = np.isfinite(mean)
    if not finite.all():
        bad = np.flatnonzero(~finite.all(axis=1))
        raise NotFiniteError(
            f"the estimate is no longer finite from {problem.t[bad[0]] * 1e-9:.6f} s on: "
            "a model function returned NaN or infinity, or the state diverged"
        )


def collect_innovations(problem: Problem, filtered: Any) -> Mapping[str, Innovations]:
    """Innovations of each sensor, by its name."""
    found = {}
    rows: NDArray[np.int64] | slice
    for index, (name, sensor) in enumerate(problem.model.sensors.items()):
        rows = slice(None)
        if len(problem.model.sensors) > 1:
            rows = np.flatnonzero(problem.schedule.sensor == index)
        m = sensor.manifold.dim
        found[name] = Innovations(
            problem.reading_t[rows],
            problem.reading_row[rows],
            masked(problem, rows, filtered.residual[rows, :m]),
            filtered.residual_cov[rows, :m, :m],
            filtered.accepted[rows].astype(bool),
        )
    return found


def masked(
    problem: Problem, readings: NDArray[np.int64] | slice, residual: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Residuals (R, m) of some readings, NaN where a component is missing."""
    m = residual.shape[1]
    if problem.plain or (problem.schedule.rows[readings] == m).all():
        return residual
    return np.where(np.isnan(problem.schedule.z[readings, :m]), np.nan, residual)


def as_run(problem: Problem, filtered: Any, log_likelihood: float, report: Report, *, keep: bool) -> Run:
    """The `Run` of a recursive filter."""
    predicted = None
    if keep:
        predicted = Prediction(filtered.predicted_mean, filtered.predicted_cov, filtered.transition)
    return Run(
        problem.t,
        filtered.mean,
        filtered.cov,
        problem.model.manifold,
        collect_innovations(problem, filtered),
        log_likelihood,
        report,
        predicted,
    )


def finished(
    problem: Problem, whole: Compiled, out: Any, name: str, ended: tuple[float, int, float], *, keep: bool
) -> Run:
    """The `Run` of a kernel that ended with (log likelihood, where it failed or -1, seconds).

    Raises
    ------
    NotFiniteError, NotPositiveDefiniteError
        where it failed, and whatever an interpreted model function raised.
    """
    log_likelihood, failed, seconds = ended
    whole.raise_failures()
    require_solved(problem, failed, out)
    require_finite(problem, out.mean)
    rejected = len(out.accepted) - int(np.count_nonzero(out.accepted))
    report = Report(name, seconds=seconds, message=whole.message(), rejected=rejected)
    return as_run(problem, out, log_likelihood, report, keep=keep)
