"""Where a still sensor stands and how fast it moves away: bias, drift, slope over temperature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.estimate import Estimate

__all__ = ["bias_of", "drift_of", "slope_of"]

Array = NDArray[np.float64]
BLOCKS = 512  # means that stand for a long recording: only what is slow matters here
WAVES = 12  # slowest cosines from which the noise at low frequency is read
WALK_WAVES = 24  # more of them where a random walk is to be told from white noise
RATIOS = np.geomspace(1e-3, 1e6, 55)  # of the walk's variance to the white one's, in the slowest wave
FEWEST = 20
SURE = 0.975


@dataclass(frozen=True, slots=True, eq=False)
class _Waves:
    """A regression seen by its slowest waves: coefficients of orthonormal functions of time.

    The first p functions span the regressors, X = Q_p R; noise whose spectrum is flat at the lowest
    frequencies puts the same variance into every coefficient.
    """

    coefficients: Array  # (p + k,)
    regressors: Array  # (p, p), the upper triangle R
    walk: Array  # (p + k, p + k), covariance that a random walk of unit density puts into them
    count: float  # readings behind one block


def bias_of(t: Array, x: Array) -> Estimate:
    """Mean of the readings about their straight line, with an interval that holds for coloured noise.

    The variance of a mean is the spectrum at frequency zero over the duration.  It is read from the twelve
    slowest cosines of the recording, so the interval is Student's with twelve degrees of freedom; it is
    honest for noise that forgets within about a fortieth of the recording.  Of a bias that walks it says
    where it was on average.

    Parameters
    ----------
    t : (N,) s, increasing
    x : (N,) readings, NaN left out

    Raises
    ------
    DataError
        for fewer than twenty readings.

    Notes
    -----
    Müller 2007, A theory of robust long-run variance estimation; Lazarus, Lewis, Stock and Watson 2018, HAR
    inference: recommendations for practice (the equal-weighted cosine estimator).
    """
    from scipy.special import stdtrit

    known = np.isfinite(x)
    seen = _seen(t, x, np.column_stack([np.ones(len(t)), t - t[known].mean()]), WAVES)
    rest = seen.coefficients[2:]
    value = float(np.mean(x[known]))
    wide = (
        float(stdtrit(len(rest), SURE)) * float(np.sqrt(np.mean(rest**2))) / abs(float(seen.regressors[0, 0]))
    )
    return Estimate(value, value - wide, value + wide)


def drift_of(t: Array, x: Array) -> Estimate:
    """Straight trend, unit/s; the interval allows for coloured noise and for a bias that walks at random.

    Parameters
    ----------
    t, x : as in `bias_of`

    Notes
    -----
    A walk looks like a trend.  How much of it there is decides about the interval, and the recording itself
    says so only roughly: the posterior of the slope is averaged over the ratio of walk to white noise
    (flat prior on its logarithm), each a Student distribution of generalised least squares.  For white noise
    the interval is twice as wide as if it were known to be white.
    """
    return slope_of(t, x, t)


def slope_of(t: Array, x: Array, against: Array) -> Estimate:
    """Slope of the readings over another slow quantity, such as temperature; interval as in `drift_of`.

    Parameters
    ----------
    against : (N,) the quantity at the stamps, without NaN

    Raises
    ------
    DataError
        where it does not change.
    """
    centred = against - against.mean()
    scale = float(np.abs(centred).max())
    if scale == 0.0:
        raise DataError("a slope needs a quantity that changes; all its values are the same")
    seen = _seen(t, x, np.column_stack([np.ones(len(t)), centred / scale]), WALK_WAVES)
    value, low, high = _posterior(seen)
    return Estimate(value / scale, low / scale, high / scale)


def _seen(t: Array, x: Array, regressors: Array, waves: int) -> _Waves:
    """Means of blocks, then coefficients of regressors and cosines made orthonormal."""
    known = np.flatnonzero(np.isfinite(x))
    if len(known) < FEWEST:
        raise DataError(f"bias and drift need {FEWEST} readings, got {len(known)}; better a thousand")
    edges = np.linspace(0, len(known), min(BLOCKS, len(known)) + 1).astype(np.int64)[:-1]
    size = np.diff(np.append(edges, len(known)))
    y, time = (np.add.reduceat(v[known], edges) / size for v in (x, t))
    columns = np.add.reduceat(regressors[known], edges, axis=0) / size[:, None]
    k = min(waves, len(y) - columns.shape[1] - 1)
    phase = (np.cumsum(size) - size / 2.0) / len(known)
    cosines = np.cos(np.pi * np.outer(phase, np.arange(1, k + columns.shape[1])))
    weight = np.sqrt(size)[:, None]  # a block of more readings is known better
    q, r = np.linalg.qr(weight * np.column_stack([columns, cosines]))
    walk = np.minimum.outer(time - t[0], time - t[0])
    shape = weight * q
    p = columns.shape[1]
    return _Waves((q.T @ (weight[:, 0] * y)), r[:p, :p], shape.T @ walk @ shape, float(size.mean()))


def _posterior(seen: _Waves) -> tuple[float, float, float]:
    """Mean and 95 % interval of the last regressor's coefficient, over all ratios of walk to white."""
    from scipy.special import stdtr

    p, d = len(seen.regressors), len(seen.coefficients)
    X = np.zeros((d, p))
    X[:p] = seen.regressors
    weight, mean, spread = (np.empty(len(RATIOS) + 1) for _ in range(3))
    for k, ratio in enumerate([0.0, *(RATIOS / seen.walk[p, p])]):
        factor = np.linalg.cholesky(np.eye(d) + ratio * seen.walk)
        white, design = np.linalg.solve(factor, seen.coefficients), np.linalg.solve(factor, X)
        q, r = np.linalg.qr(design)
        beta = np.linalg.solve(r, q.T @ white)
        rss = max(float(np.sum((white - design @ beta) ** 2)), 1e-300)
        mean[k] = beta[-1]
        spread[k] = np.sqrt(rss / (d - p)) / abs(r[-1, -1])
        weight[k] = (
            -np.log(np.diag(factor)).sum() - np.log(np.abs(np.diag(r))).sum() - 0.5 * (d - p) * np.log(rss)
        )
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()

    def below(value: float) -> float:
        return float(weight @ stdtr(d - p, (value - mean) / spread))

    ends = (_quantile(below, 1.0 - SURE, mean, spread), _quantile(below, SURE, mean, spread))
    return float(weight @ mean), *ends


def _quantile(below: Callable[[float], float], level: float, mean: Array, spread: Array) -> float:
    """Where a mixture's distribution function reaches a level, by bisection."""
    low, high = float((mean - 50 * spread).min()), float((mean + 50 * spread).max())
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) < level else (low, middle)
    return 0.5 * (low + high)
