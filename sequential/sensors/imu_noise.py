"""From a still recording of an IMU to the four numbers that a filter asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, MissingStreamError
from sequential.noise import ImuNoise
from sequential.sensors.allan import AllanDeviation, allan_deviation
from sequential.sensors.noise_fit import NoiseFit, fit_noise
from sequential.sensors.recording import ImuRecording
from sequential.sensors.stretch import longest_even_stretch, longest_still_stretch

__all__ = ["ImuNoiseReport", "filter_noise", "imu_noise"]

Array = NDArray[np.float64]
UNITS = {"gyro": "rad/s", "accel": "m/s²"}


@dataclass(frozen=True, slots=True, eq=False)
class ImuNoiseReport:
    """Noise of an IMU at rest.

    Parameters
    ----------
    noise : for `Strapdown` and Kalibr: the root mean square over the axes of each sensor; None where the
        recording lacks the gyro or the accelerometer
    bounds : fields of `noise` that are upper bounds, since no axis shows a random walk
    fits : three axes of each sensor, "gyro" and "accel"
    deviations : overlapping Allan deviation of each sensor, (T, 3)
    rate, duration : of the stretch that was used, Hz and s
    notes : sentences about the recording; those about an axis are in its fit
    """

    noise: ImuNoise | None
    bounds: tuple[str, ...]
    fits: dict[str, tuple[NoiseFit, NoiseFit, NoiseFit]]
    deviations: dict[str, AllanDeviation]
    rate: float
    duration: float
    notes: tuple[str, ...]


def imu_noise(recording: ImuRecording) -> ImuNoiseReport:
    """Noise densities and bias walks of an IMU from a recording at rest, the longer the better.

    Parameters
    ----------
    recording : at rest, in SI units; gyro, accelerometer, or both.  Where it moves now and then, the longest
        still part counts

    Raises
    ------
    DataError, MissingStreamError
        where it is not in SI units, its rate changes, or no still stretch without a pause is long enough.

    Notes
    -----
    Of axes that show a random walk, the root mean square counts; where none does, that of the upper bounds,
    which no recording of this length can tell from the truth.
    """
    sensors = [name for name in UNITS if getattr(recording, name) is not None]
    if not sensors:
        raise MissingStreamError(f"recording {recording.name!r} has neither gyro nor accelerometer")
    recording.require(*sensors)
    even, notes = longest_even_stretch(recording)
    stretch, more = longest_still_stretch(even)
    rate = (len(stretch) - 1) / stretch.duration
    fits, deviations = {}, {}
    for name in sensors:
        values: Array = getattr(stretch, name)
        deviations[name] = allan_deviation(values, rate)
        x, y, z = (_fit_axis(values[:, axis], rate, name, axis, recording.name) for axis in range(3))
        fits[name] = (x, y, z)
    noise, bounds = filter_noise(fits) if len(sensors) == 2 else (None, ())
    return ImuNoiseReport(noise, bounds, fits, deviations, rate, stretch.duration, (*notes, *more))


def filter_noise(
    fits: Mapping[str, tuple[NoiseFit, NoiseFit, NoiseFit]],
) -> tuple[ImuNoise, tuple[str, ...]]:
    """Four numbers from the fits of "gyro" and "accel", and which are upper bounds; see `imu_noise`."""
    numbers, bounds = {}, []
    for name in UNITS:
        numbers[f"{name}_density"] = _together(fits[name], "N")[0]
        numbers[f"{name}_bias_walk"], seen = _together(fits[name], "K")
        if not seen:
            bounds.append(f"{name}_bias_walk")
    return ImuNoise(**numbers), tuple(bounds)


def _fit_axis(values: Array, rate: float, sensor: str, axis: int, name: str) -> NoiseFit:
    try:
        return fit_noise(values, rate, unit=UNITS[sensor])
    except DataError as fault:
        raise DataError(f"{sensor} {'xyz'[axis]} of recording {name!r}: {fault}") from None


def _together(fits: tuple[NoiseFit, ...], term: Literal["N", "K"]) -> tuple[float, bool]:
    """One number for three axes, and whether it was seen on any."""
    seen = [fit[term].value for fit in fits if fit[term].visible]
    values = seen or [fit[term].high for fit in fits]
    return float(np.sqrt(np.mean(np.square(values)))), bool(seen)
