"""How sure a deviation of the Allan family is: colour of the noise, equivalent degrees of freedom, intervals.

C. Greenhall and W. Riley, Uncertainty of stability variances based on finite differences, PTTI 2003, gives
the degrees of freedom; W. Riley and C. Greenhall, Power law noise identification using the lag 1
autocorrelation, EFTF 2004, the colour.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["chi_square_interval", "degrees_of_freedom"]

Array = NDArray[np.float64]
MOST_TERMS = 100
# (a0, a1) of 1/edf = (a0 - a1/r)/r for long records, by α from 2 downwards and the order of the difference.
# The paper's tables 1 (modified) and 2 (unmodified); orders 2 and 3.
MODIFIED = {
    2: ((7 / 9, 1 / 2), (22 / 25, 2 / 3)),
    1: ((0.997, 0.616), (1.141, 0.843)),
    0: ((1.033, 0.607), (1.184, 0.848)),
    -1: ((1.048, 0.534), (1.180, 0.816)),
    -2: ((1.302, 0.535), (1.175, 0.777)),
    -3: ((math.nan, math.nan), (1.194, 0.703)),
    -4: ((math.nan, math.nan), (1.489, 0.702)),
}
UNMODIFIED = {
    1: ((790.0, 410.0), (9950.0, 6520.0)),
    0: ((2 / 3, 1 / 3), (7 / 9, 1 / 2)),
    -1: ((0.852, 0.375), (0.997, 0.617)),
    -2: ((1.079, 0.368), (1.033, 0.607)),
    -3: ((math.nan, math.nan), (1.053, 0.553)),
    -4: ((math.nan, math.nan), (1.302, 0.535)),
}
FLICKER_PHASE = {2: (15.23, 12.0), 3: (47.8, 40.0)}  # table 3


def chi_square_interval(deviation: Array, freedom: Array, level: float = 0.95) -> tuple[Array, Array]:
    """Two-sided interval of a deviation whose square is χ² with so many degrees of freedom."""
    from scipy.special import gammaincinv

    tail = 0.5 * (1.0 - level)
    low, high = (2.0 * gammaincinv(0.5 * freedom, p) for p in (1.0 - tail, tail))
    return deviation * np.sqrt(freedom / low), deviation * np.sqrt(freedom / np.maximum(high, 1e-300))


@lru_cache(maxsize=4096)
def degrees_of_freedom(
    alpha: int, order: int, m: int, count: int, *, overlapping: bool = True, modified: bool = False
) -> float:
    """Equivalent degrees of freedom of a variance of the Allan family.

    Parameters
    ----------
    alpha : exponent of the rate's spectrum f^α: 0 white, -1 flicker, -2 random walk, 2 white phase
    order : of the difference of the phase: 2 for Allan, 3 for Hadamard
    m : samples in one average
    count : of phases, one more than the samples of rate
    """
    strides = m if overlapping else 1
    length = m / (1 if modified else m) + m * order
    total = 1 + math.floor(strides * (count - length) / m)
    ratio = total / strides
    if alpha == 2 and not modified:
        return _white_phase(order, total, ratio)
    terms = min(total, (order + 1) * strides)
    if terms <= MOST_TERMS:
        inner = 1.0 if modified else float(m)
        if alpha <= 0 and not modified and m * (order + 1) > MOST_TERMS:
            inner = math.inf
        return 1.0 / _mean_square(terms, total, strides, inner, alpha, order)
    scale = 1.0
    if not modified and alpha == 1:
        b0, b1 = FLICKER_PHASE[order]
        scale = (b0 + b1 * math.log(m)) ** 2
    if ratio > order + 1:
        a0, a1 = (MODIFIED if modified else UNMODIFIED)[alpha][order - 2]
        return scale * ratio / (a0 - a1 / ratio)
    # fewer strides than there are, as many as terms: a short record hardly gains from the others
    fewer = MOST_TERMS / ratio
    inner = 1.0 if modified else (fewer if alpha == 1 else math.inf)
    share = _mean_square(MOST_TERMS, MOST_TERMS, fewer, inner, alpha, order)
    if alpha == 1 and not modified:
        share *= _difference(np.zeros(1), inner, alpha, order)[0] ** 2 / scale
    return 1.0 / share


def _white_phase(order: int, total: int, ratio: float) -> float:
    """White phase: differences are correlated at whole multiples of m only, by the binomial weights."""
    lags = np.arange(1, min(order, math.ceil(ratio) - 1) + 1)
    weights = np.array([math.comb(2 * order, order - int(k)) for k in lags]) / math.comb(2 * order, order)
    return float(total) / (1.0 + 2.0 * float(np.sum((1.0 - lags / ratio) * weights**2)))


def _mean_square(terms: int, total: int, strides: float, inner: float, alpha: int, order: int) -> float:
    """Mean square correlation of `total` differences, eq. 10 over the variance squared."""
    j = np.arange(terms + 1)
    weights = np.where(j == 0, 1.0, 2.0) * (1.0 - j / total)
    weights[-1] *= 0.5
    covariance = _difference(j / strides, inner, alpha, order)
    return float(np.sum(weights * covariance**2) / (covariance[0] ** 2 * total))


def _difference(t: Array, inner: float, alpha: int, order: int) -> Array:
    """Covariance of two differences of the given order, t averages apart (eq. 9)."""
    total = np.zeros_like(t)
    for k in range(-order, order + 1):
        total += (-1) ** k * math.comb(2 * order, order + k) * _averaged(t + k, inner, alpha)
    return total


def _averaged(t: Array, inner: float, alpha: int) -> Array:
    """Generalised covariance of the averaged phase (eq. 8)."""
    if math.isinf(inner):
        return _power(t, alpha + 2)
    step = 1.0 / inner
    return inner**2 * (2.0 * _power(t, alpha) - _power(t - step, alpha) - _power(t + step, alpha))


def _power(t: Array, alpha: int) -> Array:
    """Generalised covariance of a power law, but for a factor (eq. 7)."""
    size = np.abs(t)
    power = 3 - alpha
    if power % 2:
        return -size if power == 1 else size**power
    return size**power * np.log(np.where(size > 0, size, 1.0))
