"""Standard deviation of a still sensor, and how its readings are spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.estimate import Estimate
from sequential.tuning.correlation import effective_counts

__all__ = ["Distribution", "Noise", "distribution_of", "noise_of"]

Array = NDArray[np.float64]
LEAST_KURTOSIS = -1.8  # of any distribution it is -2; a variance is never known better than this allows
FEWEST_DEGREES = 1.0
MOVING = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """How much a still sensor scatters.

    Parameters
    ----------
    sigma : standard deviation about a straight line; its square is R
    n : readings behind it
    n_effective : as many independent ones would say as much about the variance
    correlation : from one reading to the next
    step_sigma : root mean square of the steps from one reading to the next over √2: σ, if the noise is white;
        less, if what is seen is slower than the readings
    rounding : standard deviation that rounding alone makes, LSB/√12
    """

    sigma: Estimate
    n: int
    n_effective: float
    correlation: float
    step_sigma: float
    rounding: float

    @property
    def moving(self) -> bool:
        """Whether readings go much farther than they differ from one to the next: a signal, not noise."""
        return self.sigma.value > MOVING * self.step_sigma > 0.0

    @property
    def reading_sigma(self) -> Estimate:
        """σ of a reading as a filter needs it: `sigma`, or that of steps where slower motion is a signal."""
        if not self.moving:
            return self.sigma
        wide = 1.96 * (0.75 / max(self.n - 1, 1)) ** 0.5  # neighbouring steps share a reading
        return Estimate(self.step_sigma, self.step_sigma * (1.0 - wide), self.step_sigma * (1.0 + wide))

    @property
    def white(self) -> bool:
        """Whether readings may be taken for independent: nearly all of them count, or chance explains it."""
        return self.n_effective > 0.9 * self.n or abs(self.correlation) < 3.0 / self.n**0.5


def noise_of(residual: Array, lsb: float = 0.0, parameters: int = 2) -> Noise:
    """σ of residuals (N,), NaN left out, with an interval that allows for coloured and heavy-tailed noise.

    Parameters
    ----------
    lsb : resolution; no σ is smaller than LSB/√12
    parameters : fitted before, such as the two of a line

    Notes
    -----
    χ² interval with 2 s⁴ / var(s²) degrees of freedom, where var(s²) = σ⁴ (2/n_eff + κ/n): the first term
    grows with the correlation (`effective_counts`), the second with the excess kurtosis κ.
    """
    from scipy.special import chdtri

    known = np.isfinite(residual)
    own = residual[known]
    n = len(own)
    for_variance, lag = effective_counts(residual)[1:]
    raw = float(np.sqrt(np.sum(own**2) / max(n - parameters, 1)))
    rounding = lsb / 12.0**0.5
    kurtosis = max(float(np.mean(own**4)) / raw**4 - 3.0, LEAST_KURTOSIS) if raw > 0.0 else 0.0
    freedom = 2.0 / (2.0 / for_variance + kurtosis / n) * (1.0 - parameters / n)
    freedom = float(np.clip(freedom, FEWEST_DEGREES, 10.0 * n))
    low, high = (raw * (freedom / float(chdtri(freedom, p))) ** 0.5 for p in (0.025, 0.975))
    sigma = Estimate(max(raw, rounding), max(low, rounding), max(high, rounding))
    steps = np.diff(residual)
    steps = steps[np.isfinite(steps)]
    step_sigma = float(np.sqrt(np.mean(steps**2) / 2.0)) if len(steps) else 0.0
    return Noise(sigma, n, min(for_variance, n), lag, step_sigma, rounding)


@dataclass(frozen=True, slots=True, eq=False)
class Distribution:
    """Histogram and distance from a normal distribution.

    Parameters
    ----------
    edges, counts : (B + 1,), (B,); edges lie between the steps of a sensor that rounds
    skewness, kurtosis : 0 for normal noise (kurtosis is the excess), with 95 % intervals
    distance : largest difference between the share of readings below a value and the normal one's
        (Kolmogorov): which share of the readings lies elsewhere, at most
    p : of skewness and kurtosis together (Jarque and Bera 1980), for the effective number of readings
    """

    edges: Array
    counts: NDArray[np.int64]
    skewness: Estimate
    kurtosis: Estimate
    distance: float
    p: float

    @property
    def nearly_normal(self) -> bool:
        """Whether a filter may take the noise for normal, however sure a test is that it is not quite."""
        return self.distance < 0.03 and self._normal_shape

    @property
    def uneven_steps(self) -> bool:
        """Whether shape and tails are normal but the distance is not: some codes come more often."""
        return self.distance >= 0.03 and self._normal_shape

    @property
    def _normal_shape(self) -> bool:
        return abs(self.skewness.value) < 0.3 and abs(self.kurtosis.value) < 1.0


def distribution_of(residual: Array, noise: Noise, lsb: float = 0.0, bins: int = 60) -> Distribution:
    """Histogram, skewness, kurtosis and normality of residuals (N,), NaN left out.

    Notes
    -----
    With a million readings any p is tiny; with twenty none is.  What matters to a filter is how far the
    distribution is from normal, so `distance` stands beside p.  A sensor that rounds is compared between its
    steps, where rounding does not show: its residuals must lie on that grid still.
    """
    own = np.sort(residual[np.isfinite(residual)])
    sigma = max(noise.sigma.value, 1e-300)
    z = (own - own.mean()) / (own.std() or 1.0)
    skewness, kurtosis = float(np.mean(z**3)), float(np.mean(z**4)) - 3.0
    n = max(noise.n_effective, 4.0)
    wide = 1.96 * np.sqrt([6.0 / n, 24.0 / n])
    jarque_bera = n / 6.0 * (skewness**2 + kurtosis**2 / 4.0)
    edges = _edges(own, sigma, lsb, bins)
    return Distribution(
        edges,
        np.histogram(own, edges)[0].astype(np.int64),
        Estimate(skewness, skewness - wide[0], skewness + wide[0]),
        Estimate(kurtosis, kurtosis - wide[1], kurtosis + wide[1]),
        _distance(own, lsb),
        float(np.exp(-0.5 * jarque_bera)),  # χ² with two degrees of freedom
    )


def _edges(own: Array, sigma: float, lsb: float, bins: int) -> Array:
    """Edges of a histogram: whole steps of the sensor, about `bins` over what is not far out."""
    middle = float(np.median(own))
    low, high = max(own[0], middle - 6.0 * sigma), min(own[-1], middle + 6.0 * sigma)
    if not high > low:
        low, high = own[0] - 0.5, own[0] + 0.5
    if lsb <= 0.0:
        return np.linspace(low, high, bins + 1)
    low = own[0] + lsb * np.floor((low - own[0]) / lsb)
    width = lsb * max(1, round((high - low) / lsb / bins))
    return np.asarray(low - 0.5 * lsb + width * np.arange(np.ceil((high - low) / width + 0.5) + 1))


def _distance(own: Array, lsb: float) -> float:
    """Kolmogorov's distance from the normal distribution of the same mean and σ."""
    from scipy.special import ndtr

    mean, sigma = float(own.mean()), float(own.std()) or 1.0
    n = len(own)
    if lsb <= 0.0:
        expected = ndtr((own - mean) / sigma)
        rank = np.arange(n)
        return float(max(np.max(expected - rank / n), np.max((rank + 1) / n - expected)))
    last = np.append(np.flatnonzero(np.diff(own) > 0.25 * lsb), n - 1)
    between = own[last] + 0.5 * lsb
    finer = (
        max(sigma**2 - lsb**2 / 12.0, (0.1 * sigma) ** 2) ** 0.5
    )  # Sheppard: what rounding added is no noise
    return float(np.abs((last + 1) / n - ndtr((between - mean) / finer)).max())
