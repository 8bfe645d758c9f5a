"""What a recording at rest says about one sensor axis, or about anything else that reports a number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from sequential.log import nanoseconds, numbers
from sequential.sensors.characterize_level import bias_of, drift_of, slope_of
from sequential.sensors.characterize_noise import Distribution, Noise, distribution_of, noise_of
from sequential.sensors.characterize_outliers import Outliers, outliers_of
from sequential.sensors.characterize_resolution import (
    Oversampling,
    Resolution,
    lsb_of,
    oversampling_of,
    resolution_of,
)
from sequential.sensors.characterize_spectrum import Spectrum, spectrum_of
from sequential.sensors.characterize_timing import Timing, timing_of
from sequential.sensors.estimate import Estimate

__all__ = ["Characteristics", "characterize"]

Array = NDArray[np.float64]
FEWEST = 50
WARM = 1.0  # °C that a temperature must change by, before anything is said about its influence


@dataclass(frozen=True, slots=True, eq=False)
class Characteristics:
    """One axis at rest; each part is described in its own module.

    Parameters
    ----------
    name, unit : of the axis
    bias : mean of the readings (with gravity, where the axis feels it)
    drift : straight trend, unit/s
    per_degree : slope over temperature, unit/°C; None without a temperature that changes
    warmed : °C by which the temperature changed, NaN without one
    noise, distribution, resolution, oversampling, outliers, spectrum, timing : see there
    t, residual : (N,) s since the first reading, and readings about the line; NaN for outliers
    """

    name: str
    unit: str
    bias: Estimate
    drift: Estimate
    per_degree: Estimate | None
    warmed: float
    noise: Noise
    distribution: Distribution
    resolution: Resolution
    oversampling: Oversampling
    outliers: Outliers
    spectrum: Spectrum
    timing: Timing
    t: Array
    residual: Array

    @property
    def drifts(self) -> bool:
        """Whether the interval of the drift leaves zero out."""
        return self.drift.low > 0.0 or self.drift.high < 0.0

    @property
    def stuck(self) -> bool:
        """Whether every reading is the same."""
        return self.resolution.levels < 2

    def to_json(self) -> dict[str, Any]:
        """Numbers by name; intervals as value, low, high."""
        noise, spread, seen = self.noise, self.distribution, self.resolution
        return {
            "unit": self.unit,
            "n": noise.n,
            "n_effective": noise.n_effective,
            "sigma": noise.sigma.to_json(),
            "step_sigma": noise.step_sigma,
            "correlation": noise.correlation,
            "bias": self.bias.to_json(),
            "drift_per_hour": self.drift.scaled(3600.0).to_json(),
            "per_degree": None if self.per_degree is None else self.per_degree.to_json(),
            "temperature_change": self.warmed,
            "lsb": seen.lsb,
            "levels": seen.levels,
            "bits": seen.bits,
            "noise_bits": seen.noise_bits,
            "effective_bits": seen.effective_bits,
            "oversampling": {
                "factor": self.oversampling.factor.tolist(),
                "bits_gained": self.oversampling.bits.tolist(),
                "bits_expected": self.oversampling.expected.tolist(),
            },
            "outliers": {
                "count": self.outliers.count,
                "share": self.outliers.share.to_json(),
                "per_hour": self.outliers.per_hour,
                "typical": self.outliers.typical,
                "largest": self.outliers.largest,
            },
            "skewness": spread.skewness.to_json(),
            "excess_kurtosis": spread.kurtosis.to_json(),
            "distance_from_normal": spread.distance,
            "p_normal": spread.p,
            "noise_density": self.spectrum.noise_density,
            "lines": [{"hz": hz, "sigma": sigma} for hz, sigma in self.spectrum.lines],
        }


def characterize(
    t: ArrayLike,
    values: ArrayLike,
    *,
    name: str = "reading",
    unit: str = "",
    temperature: ArrayLike | None = None,
    lsb: float | None = None,
    bits: int = 16,
) -> Characteristics:
    """Noise, bias, drift, resolution, outliers, distribution, spectrum and timing of a sensor at rest.

    Parameters
    ----------
    t : (N,) int64 ns, or floats in seconds, increasing
    values : (N,) readings of a sensor that did not move; NaN is a missing one
    temperature : (N,) °C, NaN where unknown
    lsb : resolution, where it is known; found from the values by default
    bits : of the converter

    Raises
    ------
    ShapeError, DataError
        for fewer than fifty readings.
    """
    stamps, x = nanoseconds(t), numbers(values, name)
    if stamps.ndim != 1 or x.shape != stamps.shape:
        raise ShapeError(f"{name} needs stamps and readings of one shape (N,), got {stamps.shape}, {x.shape}")
    if (known := int(np.isfinite(x).sum())) < FEWEST:
        raise DataError(f"{name} has {known} readings; its noise needs {FEWEST} at least, better a thousand")
    timing = timing_of(stamps)
    time = (stamps - stamps[0]) * 1e-9
    step = lsb_of(x) if lsb is None else lsb
    outliers = outliers_of(time, x, step)
    kept = np.where(outliers.where, np.nan, x)
    bias, drift = bias_of(time, kept), drift_of(time, kept)
    residual = _about_a_line(time, kept)
    noise = noise_of(residual, step)
    heat, warmed = _heat(temperature, stamps.shape)
    return Characteristics(
        name=name,
        unit=unit,
        bias=bias,
        drift=drift,
        per_degree=slope_of(time, kept, heat) if heat is not None and warmed >= WARM else None,
        warmed=warmed,
        noise=noise,
        distribution=distribution_of(_on_grid(kept, residual, step), noise, step),
        resolution=resolution_of(x, noise.sigma.value, bits, step),
        oversampling=oversampling_of(residual),
        outliers=outliers,
        spectrum=spectrum_of(residual, timing.rate),
        timing=timing,
        t=time,
        residual=residual,
    )


def _about_a_line(t: Array, x: Array) -> Array:
    known = np.isfinite(x)
    centred = t - t[known].mean()
    middle = float(x[known].mean())
    slope = float(centred[known] @ (x[known] - middle)) / float(centred[known] @ centred[known])
    return np.asarray(x - middle - slope * centred)


def _on_grid(x: Array, residual: Array, lsb: float) -> Array:
    """Residuals about a line that keeps to the steps of the sensor, so that no false teeth appear."""
    return residual if lsb <= 0.0 else np.asarray(x - lsb * np.round((x - residual) / lsb))


def _heat(given: ArrayLike | None, shape: tuple[int, ...]) -> tuple[Array | None, float]:
    """Temperature without holes, and by how much it changed between its hundredth parts."""
    if given is None:
        return None, float("nan")
    heat = numbers(given, "temperature")
    if heat.shape != shape:
        raise ShapeError(f"temperature needs one value a reading, {shape}; got {heat.shape}")
    known = np.flatnonzero(np.isfinite(heat))
    if len(known) < 2:
        return None, float("nan")
    whole = np.interp(np.arange(len(heat)), known, heat[known])
    return whole, float(np.subtract(*np.quantile(whole, [0.99, 0.01])))
