"""Recordings of a simulated thermometer: a ramp, then a plateau, white noise, one outlier."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["HIDDEN", "Trial", "hidden_trials", "public_trial"]

Array = NDArray[np.float64]

COUNT = 240  # readings, one a second
WARM_UP = 20  # readings before errors count: a filter has to learn the slope first
SETTLED = 10  # readings after the bend that belong to neither part
PUBLIC_SEED = 14
HIDDEN = 12  # trials behind a score
HIDDEN_SEED = 1960


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One recording and its truth.

    Parameters
    ----------
    t : (N,) s, one reading a second
    z : (N,) readings, °C
    truth : (N,) °C
    sigma : standard deviation of the noise, °C
    bend : row at which the ramp ends
    outlier_at : row of the outlier
    outlier : what it adds to the reading, °C
    """

    t: Array
    z: Array
    truth: Array
    sigma: float
    bend: int
    outlier_at: int
    outlier: float

    @property
    def without_outlier(self) -> Array:
        """(N,) the readings as they would have been."""
        clean = self.z.copy()
        clean[self.outlier_at] -= self.outlier
        return clean

    @property
    def ramp(self) -> slice:
        """Rows at which errors on the ramp count."""
        return slice(WARM_UP, self.bend)

    @property
    def plateau(self) -> slice:
        """Rows at which errors on the plateau count."""
        return slice(self.bend + SETTLED, COUNT)

    @property
    def rest(self) -> slice:
        """Thirty seconds of the plateau, from which R is taken."""
        return slice(COUNT - 40, COUNT - 10)


def public_trial() -> Trial:
    """The recording that everybody gets: 0.25 °C/s for 120 s, σ = 0.5 °C, +8 °C at t = 40 s."""
    rng = np.random.default_rng(PUBLIC_SEED)
    return _drawn(rng, start=20.0, slope=0.25, bend=120, sigma=0.5, outlier_at=40, outlier=8.0)


def hidden_trials(seed: int = HIDDEN_SEED, count: int = HIDDEN) -> tuple[Trial, ...]:
    """Recordings of other ramps, plateaus, noise and outliers, for the score.

    Parameters
    ----------
    seed : another one gives another set, as a teacher may want
    """
    return tuple(_hidden(own) for own in np.random.default_rng(seed).spawn(count))


def _hidden(rng: np.random.Generator) -> Trial:
    signs = rng.choice([-1.0, 1.0], 2)
    return _drawn(
        rng,
        start=rng.uniform(5.0, 35.0),
        slope=signs[0] * rng.uniform(0.12, 0.4),
        bend=int(rng.integers(90, 150)),
        sigma=rng.uniform(0.35, 0.7),
        outlier_at=int(rng.integers(30, 220)),
        outlier=signs[1] * rng.uniform(7.0, 10.0),
    )


def _drawn(
    rng: np.random.Generator,
    *,
    start: float,
    slope: float,
    bend: int,
    sigma: float,
    outlier_at: int,
    outlier: float,
) -> Trial:
    t = np.arange(COUNT, dtype=np.float64)
    truth = start + slope * np.minimum(t, bend)
    z = truth + sigma * rng.standard_normal(COUNT)
    z[outlier_at] += outlier
    return Trial(t, z, truth, float(sigma), bend, outlier_at, float(outlier))
