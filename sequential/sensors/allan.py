"""Deviations of the Allan family: how much the mean over τ seconds differs from the next one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError
from sequential.sensors.allan_freedom import chi_square_interval, degrees_of_freedom

__all__ = ["AllanDeviation", "Kind", "allan_deviation"]

Array = NDArray[np.float64]
Kind = Literal["overlapping", "hadamard", "modified", "plain"]
PER_DECADE = 20
ORDER = {"overlapping": 2, "hadamard": 3, "modified": 2, "plain": 2}
SPAN = {"overlapping": 2, "hadamard": 3, "modified": 3, "plain": 2}  # averages that one difference covers
LOWEST_COLOUR = {2: -2, 3: -4}


@dataclass(frozen=True, slots=True, eq=False)
class AllanDeviation:
    """Deviations with 95 % intervals; arrays are (T,) for one axis, (T, k) for k axes, read-only.

    Parameters
    ----------
    kind : "overlapping", "hadamard" (overlapping too), "modified" or "plain"
    rate : of the samples, Hz
    tau : (T,) averaging times, s
    deviation : in the unit of the samples
    low, high : 95 % interval, χ² with `dof` equivalent degrees of freedom
    dof : for the colour found at that τ
    alpha : that colour, as the exponent of the spectrum f^α: 0 white, -1 flicker, -2 random walk
    n : (T,) differences in the mean
    """

    kind: Kind
    rate: float
    tau: Array
    deviation: Array
    low: Array
    high: Array
    dof: Array
    alpha: NDArray[np.int64]
    n: NDArray[np.int64]

    def __post_init__(self) -> None:
        for name in ("tau", "deviation", "low", "high", "dof", "alpha", "n"):
            getattr(self, name).flags.writeable = False

    def axis(self, index: int) -> AllanDeviation:
        """One axis of several, arrays of shape (T,)."""
        if self.deviation.ndim == 1:
            raise ShapeError("this AllanDeviation has one axis, so there is none to choose")
        names = ("deviation", "low", "high", "dof", "alpha")
        return replace(self, **{name: getattr(self, name)[:, index] for name in names})


def allan_deviation(
    x: ArrayLike, rate: float, kind: Kind = "overlapping", taus: ArrayLike | None = None
) -> AllanDeviation:
    """Deviation of samples of a rate (angular rate, acceleration, temperature, range, …) over averaging time.

    Parameters
    ----------
    x : (N,) or (N, k) samples at equal intervals
    rate : samples a second, Hz
    kind : "overlapping" Allan, overlapping "hadamard" (blind to a linear drift), "modified" Allan (tells
        white from flicker of the phase), "plain" Allan without overlap
    taus : averaging times, s, rounded to whole samples; by default 20 a decade up to a quarter of the record

    Raises
    ------
    ShapeError, NotFiniteError, DataError
        for NaN, a record that is too short, an averaging time that it does not hold.

    Notes
    -----
    NIST SP 1065 (Riley 2008), eqs. 10, 11, 14 and 20; equals `allantools.oadev`, `ohdev`, `mdev`, `adev`.
    A vector of three axes may be turned: the sum of the squares over the axes stays.
    """
    series = read_series(x, rate, f"{kind} deviation")
    if kind not in get_args(Kind):
        raise DataError(f"kind is {kind!r}; there are {', '.join(get_args(Kind))}")
    m = averaging_factors(len(series), rate, SPAN[kind], taus)
    phase = np.zeros((series.shape[1], len(series) + 1))
    phase[:, 1:] = series.T
    # the mean takes no part in any difference, but its sum would cost digits
    phase[:, 1:] -= phase[:, 1:].mean(axis=1, keepdims=True)
    np.cumsum(phase[:, 1:], axis=1, out=phase[:, 1:])
    return _measured(phase, rate, kind, m, flat=np.ndim(x) == 1)


def _measured(phase: Array, rate: float, kind: Kind, m: NDArray[np.int64], *, flat: bool) -> AllanDeviation:
    from sequential.sensors import allan_kernel as kernel

    work = {2: kernel.second_differences, 3: kernel.third_differences}[ORDER[kind]]
    work = kernel.summed_differences if kind == "modified" else work
    squares = np.zeros((len(m), len(phase)))
    work(phase, m, kind != "plain", squares)
    count = phase.shape[1]
    n = count - SPAN[kind] * m + (1 if kind == "modified" else 0)
    n = -(-n // m) if kind == "plain" else n
    norm = 6.0 if kind == "hadamard" else 2.0
    scale = m.astype(np.float64) ** (4 if kind == "modified" else 2)
    deviation = np.sqrt(squares / (norm * n * scale)[:, None])
    alpha = _colours(phase, m, ORDER[kind])
    dof = np.array(
        [
            [
                degrees_of_freedom(
                    int(a),
                    ORDER[kind],
                    int(factor),
                    count,
                    overlapping=kind != "plain",
                    modified=kind == "modified",
                )
                for a in row
            ]
            for factor, row in zip(m, alpha, strict=True)
        ]
    )
    low, high = chi_square_interval(deviation, dof)
    arrays = {"deviation": deviation, "low": low, "high": high, "dof": dof, "alpha": alpha}
    if flat:
        arrays = {name: values[:, 0] for name, values in arrays.items()}
    return AllanDeviation(kind, rate, m / rate, n=n, **arrays)


def _colours(phase: Array, m: NDArray[np.int64], order: int) -> NDArray[np.int64]:
    """(T, k) exponents of the rate's spectrum; where averages are too few, that of the five before."""
    from sequential.sensors.allan_kernel import lag_one

    found = np.empty((len(m), len(phase)))
    lag_one(phase, m, order, found)
    alpha = np.clip(np.round(found) + 2, LOWEST_COLOUR[order], 2)
    known = np.isfinite(found[:, 0])
    # a record that is too short for any is taken as white
    last = np.round(np.median(alpha[known][-5:], axis=0)) if known.any() else np.zeros(len(phase))
    alpha[~known] = last
    return alpha.astype(np.int64)


def averaging_factors(count: int, rate: float, span: int, taus: ArrayLike | None) -> NDArray[np.int64]:
    """Whole numbers of samples in an average, increasing, each of which the record holds `span` times.

    Raises
    ------
    DataError
        naming the averaging time that is too long, or shorter than half a sample.
    """
    longest = (count - 1) // span
    if taus is None:
        top = max(1, count // 4)
        points = max(2, round(PER_DECADE * np.log10(top)) + 1)
        return np.unique(np.round(np.geomspace(1, top, points)).astype(np.int64))
    wanted = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    if wanted.ndim != 1 or not len(wanted) or not np.isfinite(wanted).all():
        raise DataError(f"taus must be (T,) finite averaging times in seconds, got {taus!r}")
    m = np.unique(np.round(wanted * rate).astype(np.int64))
    if m[0] < 1 or m[-1] > longest:
        raise DataError(
            f"averaging times from {wanted.min():g} to {wanted.max():g} s do not all fit: {count} samples at "
            f"{rate:g} Hz allow {1 / rate:g} to {longest / rate:g} s"
        )
    return m


def read_series(x: ArrayLike, rate: float, what: str) -> Array:
    """Samples as (N, k), or a sentence about what is wrong with them."""
    series = np.asarray(x, dtype=np.float64)
    series = series[:, None] if series.ndim == 1 else series
    if series.ndim != 2 or not series.shape[1]:
        raise ShapeError(f"the {what} takes samples of shape (N,) or (N, k), got {np.shape(x)}")
    if not (np.isfinite(rate) and rate > 0):
        raise DataError(f"the {what} needs the rate of the samples in Hz, a positive number; got {rate}")
    if len(series) < 8:
        raise DataError(f"the {what} needs 8 samples at least, got {len(series)}; record for longer")
    bad = ~np.isfinite(series)
    if bad.any():
        at, axis = np.argwhere(bad)[0]
        raise NotFiniteError(
            f"the {what} met {series[at, axis]} at sample {at} of axis {axis} ({int(bad.sum())} such "
            "numbers); fill single gaps by interpolation, or give the longest stretch without any"
        )
    return series
