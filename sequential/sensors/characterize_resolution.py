"""The step of a sensor, the bits that its noise leaves, and what averaging gives back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Oversampling", "Resolution", "lsb_of", "oversampling_of", "resolution_of"]

Array = NDArray[np.float64]
OFF = 0.08  # of a step, root mean square, that values may lie beside their grid; 0.29 where there is none
FINER = 6  # the smallest difference seen is at most so many steps
FEW = 12  # levels that a grid needs where values are not exactly on it
EXACT = 1e-6
BLOCKS = 20  # means that an average needs at least, for its scatter to be known


@dataclass(frozen=True, slots=True)
class Resolution:
    """The smallest difference that a recording shows, beside its noise.

    Parameters
    ----------
    lsb : one step in the unit of the readings; 0 where values lie on no grid
    levels : different values seen
    bits : of the converter, as declared
    noise_bits : log2(σ √12 / LSB), the bits that carry noise; 0 where rounding is all the noise there is
    """

    lsb: float
    levels: int
    bits: int
    noise_bits: float

    @property
    def effective_bits(self) -> float:
        """Bits of an ideal converter over the same range that would be as noisy; NaN without a grid."""
        return self.bits - self.noise_bits if self.lsb > 0.0 else float("nan")


def resolution_of(values: Array, sigma: float, bits: int = 16, lsb: float | None = None) -> Resolution:
    """Step and effective bits of readings (N,) whose noise is `sigma`.

    Parameters
    ----------
    bits : of the converter; its range is LSB · 2^bits
    lsb : where it is known; found from the values by default
    """
    own = values[np.isfinite(values)]
    step = lsb_of(own) if lsb is None else lsb
    noise = max(np.log2(max(sigma, 1e-300) * 12.0**0.5 / step), 0.0) if step > 0.0 else float("nan")
    return Resolution(step, len(np.unique(own)), bits, float(noise))


def lsb_of(values: Array) -> float:
    """The step on whose grid the values (N,) lie, or 0 where they lie on none.

    Values may lie a little beside their grid, as where a file was written with few digits: the step is the
    slope of a line through the levels, counted from one to the next.
    """
    levels = np.unique(values[np.isfinite(values)])
    if len(levels) < 2:
        return 0.0
    gaps = np.diff(levels)
    floor = 1e-12 * float(np.abs(levels).max())  # what is left of rounding in the computer
    gaps = gaps[gaps > floor]
    smallest = float(gaps.min())
    for finer in range(1, FINER + 1):
        step, off = _grid(gaps, smallest / finer)
        if off < EXACT or (off < OFF and len(gaps) >= FEW):
            return step
    return 0.0


def _grid(gaps: Array, guess: float) -> tuple[float, float]:
    """Step of a grid near a guess, and the root mean square distance of the levels from it in steps."""
    count = np.append(0.0, np.cumsum(np.round(gaps / guess)))
    level = np.append(0.0, np.cumsum(gaps))
    k, v = count - count.mean(), level - level.mean()
    step = float(k @ v) / float(k @ k)
    return step, float(np.sqrt(np.mean((v - step * k) ** 2))) / step


@dataclass(frozen=True, slots=True, eq=False)
class Oversampling:
    """How much averaging helps.

    Parameters
    ----------
    factor : (T,) readings in a mean, powers of four
    sigma : (T,) standard deviation of such a mean, from the differences of neighbouring means
    bits : (T,) gained over one reading, log2(sigma[0] / sigma)
    error : (T,) standard error of `bits`
    expected : (T,) bits that white noise would give: half of log2(factor), one for every factor of four
    """

    factor: NDArray[np.int64]
    sigma: Array
    bits: Array
    error: Array
    expected: Array

    @property
    def useful(self) -> int:
        """Largest factor up to which every fourfold averaging gains half a bit at least."""
        gained = np.diff(self.bits)
        poor = np.flatnonzero(gained < 0.5)
        return int(self.factor[poor[0]] if len(poor) else self.factor[-1])


def oversampling_of(residual: Array) -> Oversampling:
    """Scatter of the means of 1, 4, 16 … readings (N,); NaN left out.

    Neighbouring means are compared (Allan's deviation), so that a drift does not count as noise.
    """
    own = residual[np.isfinite(residual)]
    factors, sigmas, errors = [], [], []
    factor = 1
    while len(own) // factor >= BLOCKS or factor == 1:
        means = own[: len(own) // factor * factor].reshape(-1, factor).mean(axis=1)
        factors.append(factor)
        sigmas.append(float(np.sqrt(0.5 * np.mean(np.diff(means) ** 2))))
        # neighbouring differences share a mean: 1.5 times the variance of as many independent ones
        errors.append(float(np.sqrt(0.5 * 1.5 / max(len(means) - 1, 1)) / np.log(2.0)))
        factor *= 4
    sigma = np.maximum(np.array(sigmas), 1e-300)
    return Oversampling(
        np.array(factors), sigma, np.log2(sigma[0] / sigma), np.array(errors), 0.5 * np.log2(factors)
    )
