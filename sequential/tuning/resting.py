"""Is a recording at rest?  Its line, its outliers, its resolution, and the parts that moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Resting", "at_rest", "line_of", "resolution"]

Array = NDArray[np.float64]

MAD = 1.4826  # of a normal distribution: σ over the median absolute deviation
EXPECTED = (
    0.05  # normal readings beyond the limit for outliers that a recording of any length is expected to have
)
FEW = 0.02  # share of the readings: more than this are not outliers but something that happened
PARTS = 10  # the recording is cut into these, and their scatter compared
UNEQUAL = 1.5  # a part scatters more when its σ is by this factor larger …
SURE = 4.0  # … and by this many standard errors of log σ
ROUNDS = 30
GRID = 1e-6  # relative to a step: how exactly values must lie on a grid to be called quantised


@dataclass(frozen=True, slots=True, eq=False)
class Resting:
    """Readings about their lines.

    `residual` and `trend` are (N, m), `kept` (N,) is False for outliers, `limit` in σ is where they begin.
    """

    residual: Array
    trend: Array
    kept: NDArray[np.bool_]
    limit: float
    worst: tuple[int, float] | None  # part that scatters more than the others, and by which factor

    @property
    def share(self) -> float:
        """Share of readings left out."""
        return float(np.mean(~self.kept))

    def notes(self, name: str, t: Array) -> list[str]:
        """A sentence about the readings left out."""
        count = int((~self.kept).sum())
        if not count:
            return []
        when = ", ".join(f"{x:.4g}" for x in t[~self.kept][:3])
        more = " …" if count > 3 else ""
        word = "reading" if count == 1 else "readings"
        told = f"{count} {word} of {name} beyond {self.limit:.1f} σ left out (t = {when}{more} s)"
        return [told]

    def faults(self, name: str, t: Array) -> list[str]:
        """Sentences that say why this is no recording at rest."""
        found = []
        if self.share > FEW:
            out = t[~self.kept]
            low, high = np.quantile(out, [0.05, 0.95])
            found.append(
                f"{self.share:.0%} of the readings of {name} lie beyond {self.limit:.1f} σ, most during "
                f"t = {low:.4g}-{high:.4g} s: the sensor was not still, or its noise is not normal"
            )
        if self.worst is not None:
            part, factor = self.worst
            edges = np.linspace(t[0], t[-1], PARTS + 1)
            found.append(
                f"{name} is not still: its scatter during t = {edges[part]:.4g}-{edges[part + 1]:.4g} s is "
                f"{factor:.2g}x that of the rest; cut the log there"
            )
        return found


def at_rest(t: Array, values: Array, steps: Array) -> Resting:
    """Take out a robust line from each column of (N, m) and mark the rows with outliers.

    Parameters
    ----------
    t : (N,) s
    steps : (m,) resolution, 0 where values are continuous; no scatter is taken to be less than a step's
    """
    from scipy.special import ndtri

    limit = float(-ndtri(EXPECTED / (2.0 * values.size)))
    trend = np.stack([robust_line(t, v) for v in values.T], axis=1)
    residual = values - trend
    spread = np.maximum(MAD * np.median(np.abs(residual), axis=0), steps / 2.0)
    spread = np.where(spread > 0.0, spread, np.maximum(residual.std(axis=0), 1e-300))
    kept = np.asarray((np.abs(residual) <= limit * spread).all(axis=1))
    if 3 < kept.sum() < len(kept):  # a plain line through what is kept is the better one
        trend = np.stack([_line(t, v, kept.astype(np.float64)) for v in values.T], axis=1)
    elif kept.all():
        trend = np.stack([_line(t, v, np.ones(len(t))) for v in values.T], axis=1)
    residual = values - trend
    return Resting(residual, trend, kept, limit, _uneven(t, residual, kept, steps))


def robust_line(t: Array, v: Array) -> Array:
    """(N,) line through (N,) readings by reweighted least squares, Tukey's biweight (c = 4.685)."""
    weight = np.ones(len(v))
    fitted = np.full(len(v), np.median(v))
    for _ in range(ROUNDS):
        residual = v - fitted
        scale = MAD * float(np.median(np.abs(residual)))
        if scale <= 0.0:
            return _line(t, v, (np.abs(residual) <= np.abs(residual).mean()).astype(np.float64))
        weight = np.clip(1.0 - (residual / (4.685 * scale)) ** 2, 0.0, None) ** 2
        before, fitted = fitted, _line(t, v, weight)
        if np.abs(fitted - before).max() < 1e-6 * scale:
            break
    return fitted


def _line(t: Array, v: Array, weight: Array) -> Array:
    """(N,) weighted least-squares line."""
    total = weight.sum()
    if total <= 0.0:
        return np.full(len(v), np.median(v))
    centre, middle = float(weight @ t / total), float(weight @ v / total)
    spread = float(weight @ (t - centre) ** 2)
    slope = float(weight @ ((t - centre) * (v - middle))) / spread if spread > 0.0 else 0.0
    return np.asarray(middle + slope * (t - centre))


def line_of(t: Array, trend: Array) -> float:
    """Slope of a line given by its values (N,)."""
    span = float(t[-1] - t[0])
    return float(trend[-1] - trend[0]) / span if span > 0.0 else 0.0


def _uneven(t: Array, residual: Array, kept: NDArray[np.bool_], steps: Array) -> tuple[int, float] | None:
    """The part of the recording that scatters most, if it does so beyond chance."""
    from sequential.tuning.correlation import effective_counts

    if kept.sum() < 8 * PARTS:
        return None
    part = np.clip(np.searchsorted(np.linspace(t[0], t[-1], PARTS + 1), t, side="right") - 1, 0, PARTS - 1)
    worst: tuple[int, float] | None = None
    for column, step in zip(residual.T, steps, strict=True):
        share = effective_counts(np.where(kept, column, np.nan))[1] / kept.sum()
        for k in range(PARTS):
            inside, outside = column[kept & (part == k)], column[kept & (part != k)]
            if len(inside) < 4 or not (outside.any() or step > 0.0):
                continue
            factor = float(inside.std() / max(outside.std(), step / 2.0))
            error = (0.5 / max(share * len(inside), 1.0)) ** 0.5
            if factor > UNEQUAL and np.log(factor) > SURE * error and (worst is None or factor > worst[1]):
                worst = (k, factor)
    return worst


def resolution(values: Array) -> float:
    """The step on whose grid the values (N,) lie, or 0: few values, at multiples of one distance."""
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > len(values) / 2:
        return 0.0
    gaps = np.diff(levels)
    step = float(gaps.min())
    off = np.abs(gaps / step - np.round(gaps / step))
    return step if off.max() < max(GRID, 1e-9 * float(np.abs(levels).max()) / step) else 0.0
