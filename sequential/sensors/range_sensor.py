"""A distance sensor whose reading falls with distance, v = a / (d + b) + c: infrared triangulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError
from sequential.sensors.finding import Finding
from sequential.sensors.range_fit import curve, fit_curve, foreign_rows, inverse_curve

__all__ = ["RangeFit", "RangeSensor"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FEWEST = 5
GRID = 2000


@dataclass(frozen=True, slots=True, eq=False)
class RangeFit:
    """The curve v = a / (d + b) + c of one sensor.

    Parameters
    ----------
    parameters, cov : (3,) a, b, c in the table's units, and their covariance (3, 3)
    sigma : standard deviation of one reading
    distances, readings : (N,) the table
    used : (N,) False for rows on the folded branch, and for rows that disagree with all others
    folded_below : distance under which the reading falls again, None where the table shows no such thing
    findings : what a reader of the constants should know
    """

    parameters: Array
    cov: Array
    sigma: float
    distances: Array
    readings: Array
    used: Mask
    folded_below: float | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def a(self) -> float:
        """Gain, reading times distance."""
        return float(self.parameters[0])

    @property
    def b(self) -> float:
        """Offset of the distance."""
        return float(self.parameters[1])

    @property
    def c(self) -> float:
        """Reading at infinity."""
        return float(self.parameters[2])

    @property
    def span(self) -> tuple[float, float]:
        """Smallest and largest distance that the curve was fitted to."""
        fitted = self.distances[self.used]
        return float(fitted.min()), float(fitted.max())

    @property
    def residuals(self) -> Array:
        """(N,) reading minus curve, NaN where the curve has its pole."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.readings - curve(self.parameters, self.distances))

    def reading(self, d: ArrayLike) -> Array:
        """What the sensor reads at distances d."""
        return curve(self.parameters, np.asarray(d, dtype=np.float64))

    def distance(self, v: ArrayLike) -> Array:
        """Distance from readings v; NaN for one that no distance gives (at the asymptote c or beyond)."""
        return inverse_curve(self.parameters, np.asarray(v, dtype=np.float64))

    def distance_sigma(self, v: ArrayLike, *, sigma: float | None = None, samples: int = 1) -> Array:
        """Standard deviation of the distance from readings v, first order, of constants and reading.

        Parameters
        ----------
        v : readings
        sigma : standard deviation of one reading; None: that of the fit
        samples : independent readings of which v is the mean
        """
        if samples < 1:
            raise DataError(f"distance_sigma: samples is {samples}; a mean is of one reading at least")
        given = np.asarray(v, dtype=np.float64)
        noise = (self.sigma if sigma is None else sigma) ** 2 / samples
        a, _, c = self.parameters
        # d = a/(v - c) - b by a, b, c and v; beyond the asymptote there is no distance
        above = np.where(np.isnan(self.distance(given)), np.nan, given - c)
        slope = np.stack([1 / above, -np.ones_like(above), a / above**2], axis=-1)
        known = np.einsum("...i,ij,...j->...", slope, self.cov, slope)
        return np.asarray(np.sqrt(known + slope[..., 2] ** 2 * noise))

    def sigma_at(self, d: ArrayLike, *, sigma: float | None = None, samples: int = 1) -> Array:
        """Standard deviation of the distance where the true distance is d."""
        return self.distance_sigma(self.reading(d), sigma=sigma, samples=samples)

    def useful_range(
        self, limit: float | None = None, *, relative: float = 0.05, samples: int = 1
    ) -> tuple[float, float] | None:
        """Distances, within the span of the table, over which a reading is good enough; None if none.

        Parameters
        ----------
        limit : largest standard deviation of the distance, in the table's unit; None uses `relative`
        relative : largest standard deviation over distance
        samples : readings averaged
        """
        low, high = self.span
        d = np.linspace(low, high, GRID)
        asked = relative * np.abs(d) if limit is None else np.full(GRID, float(limit))
        good = np.concatenate([[False], self.sigma_at(d, samples=samples) <= asked, [False]])
        edges = np.diff(good.astype(np.int8))
        starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        if not len(starts):
            return None
        longest = int(np.argmax(stops - starts))
        return float(d[starts[longest]]), float(d[stops[longest] - 1])


@dataclass(frozen=True, slots=True)
class RangeSensor:
    """Settings of the fit.

    Parameters
    ----------
    sigma : standard deviation of one reading where it is known (a still recording); None: from the fit
    fold : look for a branch at short distance where the reading falls again (Sharp's sensors); leave it out
    outliers : leave out rows that the curve through all others cannot explain
    """

    sigma: float | None = None
    fold: bool = True
    outliers: bool = True

    def fit(self, distances: ArrayLike, readings: ArrayLike) -> RangeFit:
        """Fit a table of distances (N,) and readings (N,).

        Raises
        ------
        ShapeError, NotFiniteError, DataError, UnderConstrainedError, NotConvergedError
        """
        d, v = _table(distances, readings)
        findings: list[Finding] = []
        peak = _fold(d, v) if self.fold else None
        used = np.ones(len(d), dtype=bool) if peak is None else d >= peak
        if peak is not None:
            findings.append(
                Finding(
                    "warn",
                    f"below {peak:g} the reading falls again: {int((~used).sum())} rows left out",
                    f"distances under {peak:g}",
                    "a reading there looks like a far one; mount the sensor so that nothing comes nearer",
                )
            )
        _require_enough(d[used])
        weights = np.ones(len(d))
        if self.outliers:
            foreign = foreign_rows(d[used], v[used], weights[used])
            rows = np.flatnonzero(used)[foreign]
            used[rows] = False
            findings += [
                Finding(
                    "warn",
                    f"row {row + 1} (distance {d[row]:g}, reading {v[row]:g}) disagrees with all others and "
                    "is left out",
                    "",
                    "measure it again",
                )
                for row in rows
            ]
        p, inverse = fit_curve(d[used], v[used], weights[used])
        free = int(used.sum()) - 3
        scatter = float(np.sqrt(np.sum((v[used] - curve(p, d[used])) ** 2) / free))
        sigma = scatter if self.sigma is None else self.sigma
        # a model that does not fit is no better known than its residuals
        cov = inverse * max(scatter, sigma) ** 2 if self.sigma is not None else inverse * scatter**2
        findings += _doubts(p, cov, scatter, self.sigma, free)
        return RangeFit(p, (cov + cov.T) / 2, sigma, d, v, used, peak, tuple(findings))


def _table(distances: ArrayLike, readings: ArrayLike) -> tuple[Array, Array]:
    try:
        d, v = (np.asarray(one, dtype=np.float64) for one in (distances, readings))
    except (TypeError, ValueError) as error:
        raise DataError(f"distances and readings must be numbers: {error}") from error
    if d.ndim != 1 or d.shape != v.shape:
        raise ShapeError(f"distances and readings must have one shape (N,), got {d.shape} and {v.shape}")
    for name, values in (("distance", d), ("reading", v)):
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise NotFiniteError(
                f"{name} in row {row + 1} is {values[row]}; leave the row out, or measure it again"
            )
    if (d < 0).any():
        raise DataError(f"distance in row {int(np.argmin(d)) + 1} is {d.min():g}; a distance is zero or more")
    _require_enough(d)
    if not np.ptp(v) > 0:
        raise DataError(f"all {len(v)} readings are {v[0]:g}: the sensor is not connected, or saturated")
    d.flags.writeable = v.flags.writeable = False
    return d, v


def _require_enough(d: Array) -> None:
    different = len(np.unique(d))
    if different < FEWEST:
        raise DataError(
            f"a curve of three constants needs {FEWEST} different distances at least, got {different}; ten "
            "from the shortest to the longest are good"
        )


def _fold(d: Array, v: Array) -> float | None:
    """Distance of the largest mean reading where shorter distances read clearly less, else None."""
    places = np.unique(d)
    mean = np.array([v[d == place].mean() for place in places])
    rising = np.corrcoef(places, v_of_rank(mean))[0, 1] > 0.5
    if rising or len(places) < FEWEST + 1:
        return None
    peak = int(np.argmax(mean))
    drop = float(mean[peak] - mean[:peak].min()) if peak else 0.0
    # noise alone makes neighbours change places: the drop must stand out of the scatter between neighbours
    after = np.diff(mean[peak:], 2)
    scatter = float(np.median(np.abs(after))) if len(after) else 0.0
    return float(places[peak]) if drop > max(0.05 * float(np.ptp(mean)), 0.5 * scatter) else None


def v_of_rank(values: Array) -> Array:
    """Ranks (N,) of values, as numbers."""
    return np.argsort(np.argsort(values)).astype(np.float64)


def _doubts(p: Array, cov: Array, scatter: float, sigma: float | None, free: int) -> list[Finding]:
    found = []
    if p[0] < 0:
        found.append(Finding("note", "the reading rises with distance (a < 0)"))
    if sigma is not None and free > 2 and scatter > 2 * sigma:
        found.append(
            Finding(
                "warn",
                f"the table scatters by {scatter:.3g} about the curve, a reading by {sigma:.3g}",
                "",
                "the model does not hold over all of the range, or the distances are not that exact",
            )
        )
    if np.sqrt(cov[0, 0]) > 0.3 * abs(p[0]):
        found.append(
            Finding(
                "warn",
                f"a is known to {100 * np.sqrt(cov[0, 0]) / abs(p[0]):.0f} % only: the readings hardly bend",
                "",
                "add short and long distances",
            )
        )
    return found
