"""A still record in cosines, where white noise, flicker and random walk hardly mix.

The type-II discrete cosine transform of N samples is an exact principal-component analysis of white noise
and of a random walk about an unknown mean: its coefficients k = 1 … N-1 are independent.  Flicker noise
couples the first few, by a matrix known in closed form; a linear drift moves the odd ones.
Samples and times are scaled before: one sample a second, of unit variance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["COMPONENTS", "CosineSpectrum", "Low", "cosine_spectrum", "flicker_matrix", "weights"]

Array = NDArray[np.float64]
COMPONENTS = ("Q", "N", "B", "K")  # quantisation, white, flicker, random walk
LOW = 48  # coefficients that are taken with all their correlations
BIN_RATIO = 1.04
MEDIAN = 0.4549364  # of χ² with one degree of freedom
FEW = 24  # coefficients that a bin must have for its median to be trusted


@dataclass(frozen=True, slots=True, eq=False)
class Low:
    """The first coefficients of one parity.

    Parameters
    ----------
    value : (h,)
    weight : (4, h) variances of one unit of each component squared, flicker's left at 0
    flicker : (h, h) covariance of one unit of flicker squared
    drift : (h,) what a drift of one a sample does to them; None where it does nothing
    """

    value: Array
    weight: Array
    flicker: Array
    drift: Array | None


@dataclass(frozen=True, slots=True, eq=False)
class CosineSpectrum:
    """One axis: low coefficients one by one, the others' power in narrow bins.

    Parameters
    ----------
    count : samples
    scale : standard deviation of the samples about their straight line
    slope : of that line, in `scale` a sample
    low : odd and even coefficients
    power, freedom : (b,) sum of the squares in a bin, and how many; both 0 where a line was left out
    weight : (4, b) variance of a coefficient for one unit of each component squared
    frequency : (b,) centre, cycles a sample
    lines : (frequency, rms) of what stands out, in cycles a sample and `scale`
    """

    count: int
    scale: float
    slope: float
    low: tuple[Low, Low]
    power: Array
    freedom: Array
    weight: Array
    frequency: Array
    lines: tuple[tuple[float, float], ...]

    def below(self, frequency: float) -> CosineSpectrum:
        """Without what is above a frequency, in cycles a sample."""
        kept = self.frequency <= frequency
        return replace(
            self,
            power=self.power[kept],
            freedom=self.freedom[kept],
            weight=self.weight[:, kept],
            frequency=self.frequency[kept],
        )


def weights(k: Array, count: int) -> Array:
    """(4, …) variance of coefficient k, 1 to count - 1, for one unit of Q², N², B², K².

    The two-sided densities of IEEE Std 952-1997, annex C: (2πf Q)², N², B²/2πf, (K/2πf)², the first and the
    last for differences and sums of samples.
    """
    turn = (2.0 * np.sin(0.5 * np.pi * k / count)) ** 2
    return np.stack([turn, np.ones_like(turn), count / (np.pi * k), 1.0 / turn])


def flicker_matrix(size: int) -> Array:
    """(size, size) covariance of the first cosine coefficients of a noise of two-sided density 1/|f|.

    With a = πk: 4/a [Si(a) - (1 - cos a)/a] on the diagonal, 8 [Cin(a_j) - Cin(a_k)] / (a_k² - a_j²) between
    coefficients of the same parity, 0 between others; 2/k far from the first.
    """
    from scipy.special import sici

    k = np.arange(1, size + 1)
    a = np.pi * k
    sine, cosine = sici(a)
    entire = np.log(a) - cosine  # Cin, but for a constant
    square = a**2 - a[:, None] ** 2
    matrix: Array = 8.0 * (entire[:, None] - entire) / np.where(square == 0.0, 1.0, square)
    matrix[(k[:, None] + k) % 2 == 1] = 0.0
    np.fill_diagonal(matrix, 4.0 / a * (sine - (1.0 - np.cos(a)) / a))
    return matrix


def cosine_spectrum(x: Array) -> CosineSpectrum:
    """Cosine coefficients of x (N,), N >= 64, not constant, without its straight line."""
    from scipy.fft import dct

    count = len(x)
    t = np.arange(count) - 0.5 * (count - 1)
    rest = x - x.mean()
    slope = float(t @ rest / (t @ t))
    rest = rest - slope * t
    scale = float(np.sqrt(rest @ rest / count))
    value = dct(rest / max(scale, 1e-300), type=2, norm="ortho")[1:]
    size = min(LOW, count // 4 * 2)
    weight = weights(np.arange(1.0, size + 1.0), count)
    weight[2] = 0.0
    flicker = count / (2.0 * np.pi) * flicker_matrix(size)
    drift = dct(t, type=2, norm="ortho")[1 : size + 1]
    low = [
        Low(value[p:size:2], weight[:, p::2], flicker[p::2, p::2], None if p else drift[p::2]) for p in (0, 1)
    ]
    edges = _edges(size, count - 1)
    square = value**2
    power, freedom = np.add.reduceat(square, edges[:-1]), np.diff(edges).astype(np.float64)
    middle = 0.5 * (edges[:-1] + edges[1:] + 1).astype(np.float64)
    lines, kept = _lines(square, edges, count)
    return CosineSpectrum(
        count,
        scale,
        slope / max(scale, 1e-300),
        (low[0], low[1]),
        power * kept,
        freedom * kept,
        weights(middle, count),
        middle / (2 * count),
        lines,
    )


def _edges(start: int, stop: int) -> NDArray[np.int64]:
    """Where bins of growing width begin, the last one's end included."""
    edges = [start]
    while edges[-1] < stop:
        edges.append(max(edges[-1] + 1, int(edges[-1] * BIN_RATIO)))
    edges[-1] = stop
    return np.array(edges)


def _lines(
    square: Array, edges: NDArray[np.int64], count: int
) -> tuple[tuple[tuple[float, float], ...], NDArray[np.bool_]]:
    """Periodic disturbances, which stand out of their bin, and the bins that are free of them.

    The median of a bin does not feel a line.  A line leaks into its neighbours, so bins beside it go too for
    as long as their mean is above what their median says.
    """
    bins = np.diff(edges)
    level = np.array([np.median(square[a:b]) for a, b in pairwise(edges)]) / MEDIAN
    mean = np.add.reduceat(square, edges[:-1]) / bins
    highest = np.maximum.reduceat(square, edges[:-1])
    trusted = (bins >= FEW) & (level > 0)
    stands_out = trusted & (highest > 2.0 * (np.log(count) + 4.0) * level)
    # the median of n values is sure to 1.86/√n, their mean to √(2/n)
    uneven = trusted & (mean > level * (1.0 + 8.0 / np.sqrt(bins)))
    dropped = stands_out.copy()
    for order in (range(1, len(bins)), range(len(bins) - 2, -1, -1)):
        for b in order:
            dropped[b] |= dropped[b - order.step] and uneven[b]
    found = []
    for b in np.flatnonzero(stands_out).tolist():
        if highest[b] == highest[max(b - 1, 0) : b + 2].max():
            at = edges[b] + int(np.argmax(square[edges[b] : edges[b + 1]]))
            excess = max((mean[b] - level[b]) * bins[b], highest[b] - level[b])
            found.append((float((at + 1) / (2 * count)), float(np.sqrt(excess / count))))
    return tuple(found), ~dropped
