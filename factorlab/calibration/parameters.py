"""Constants as a person reads them: a name, a value, a 95 % interval, a unit, and the nominal value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factorlab.calibration.job import Calibrated

__all__ = ["Parameter", "parameters_of"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One constant; `interval` is None where no covariance is known, `nominal` where there is none."""

    sensor: str
    name: str
    value: float
    interval: tuple[float, float] | None
    unit: str
    nominal: float | None
    observed: bool = True

    def to_json(self) -> dict[str, object]:
        """Plain values under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


def parameters_of(done: Calibrated) -> tuple[Parameter, ...]:
    """All constants of a job, in the order of a data sheet: gain, misalignment, offset; sensor by sensor."""
    found: list[Parameter] = []
    if done.accel is not None:
        found += _accel(done)
    gyro = done.calibration.gyro
    if gyro is not None:
        freedom = done.gyro.fit.freedom if done.gyro is not None else max(len(done.dwells) - 1.0, 1.0)
        half = _t95(freedom)
        sigma = np.sqrt(np.diag(gyro.cov)) if gyro.cov is not None else np.zeros(12)
        si = gyro.unit_in == "rad/s"
        for k, axis in enumerate("xyz"):
            per, unit = (1.0, "") if si else (1.0, f"rad/s per {gyro.unit_in}")
            found.append(
                _one(
                    "gyro",
                    f"gain {axis}",
                    gyro.matrix[k, k] * per,
                    half * sigma[4 * k],
                    unit,
                    1.0 if si else None,
                )
            )
        for row in range(3):
            for column in range(3):
                if row != column and done.gyro is not None:
                    value = np.degrees(gyro.matrix[row, column] / gyro.matrix[column, column])
                    spread = np.degrees(half * sigma[3 * row + column] / gyro.matrix[column, column])
                    found.append(
                        _one("gyro", f"misalignment {'xyz'[row]}{'xyz'[column]}", value, spread, "°", 0.0)
                    )
        scale, unit = (np.degrees(1.0), "°/s") if si else (1.0, gyro.unit_in)
        for k, axis in enumerate("xyz"):
            found.append(
                _one(
                    "gyro",
                    f"offset {axis}",
                    gyro.offset[k] * scale,
                    half * sigma[9 + k] * scale,
                    unit,
                    0.0 if si else None,
                )
            )
    return tuple(found)


def _accel(done: Calibrated) -> list[Parameter]:
    accel = done.accel
    assert accel is not None  # noqa: S101 - the caller has looked
    fit, unit = accel.fit, accel.calibration.unit_in
    si = unit == "m/s^2"
    half = _t95(fit.freedom + 1.0) * np.sqrt(np.diag(fit.cov))
    names = [f"gain {a}" for a in "xyz"] + ["misalignment yx", "misalignment zx", "misalignment zy"]
    names += [f"offset {a}" for a in "xyz"]
    units = ["" if si else f"m/s² per {unit}"] * 3 + ["°"] * 3 + ["m/s²" if si else unit] * 3
    nominal = [1.0 if si else None] * 3 + [0.0] * 3 + [0.0 if si else None] * 3
    scale = np.concatenate([np.ones(3), np.full(3, np.degrees(1.0)), np.ones(3)])
    shears = bool(np.any(fit.parameters[3:6] != 0.0))
    return [
        _one(
            "accel",
            names[k],
            fit.parameters[k] * scale[k],
            half[k] * scale[k],
            units[k],
            nominal[k],
            fit.kept[k] < 0.7,
        )
        for k in range(9)
        if shears or not 3 <= k < 6
    ]


def _one(
    sensor: str, name: str, value: float, half: float, unit: str, nominal: float | None, observed: bool = True
) -> Parameter:
    interval = (float(value - half), float(value + half)) if half > 0 else None
    return Parameter(sensor, name, float(value), interval, unit, nominal, bool(observed))


def _t95(freedom: float) -> float:
    """How many standard deviations hold 95 %."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1.0), 0.975))
