"""Constants as a person reads them: a name, a value, a 95 % interval, a unit, and the nominal value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factorlab.calibration.job import Calibrated
from sequential.sensors import AffineCalibration
from sequential.sensors.gravity_fit import Prior

__all__ = ["Parameter", "parameters_of"]

Mask = NDArray[np.bool_]
VAGUE = 0.7  # of the prior's width: the recording says nothing


@dataclass(frozen=True, slots=True)
class Parameter:
    """One constant; `interval` is None where no covariance is known, `nominal` where there is no such value.

    `observed` is False where the recording does not show it and what is known beforehand stands.
    """

    sensor: str
    name: str
    value: float
    interval: tuple[float, float] | None
    unit: str
    nominal: float | None
    observed: bool

    def to_json(self) -> dict[str, object]:
        """Plain values under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


def parameters_of(done: Calibrated) -> tuple[Parameter, ...]:
    """All constants of a job, in the order of a data sheet: gain, misalignment, offset; sensor by sensor."""
    found: list[Parameter] = []
    if done.accel is not None and done.calibration.accel is not None:
        crossed = bool(np.any(np.abs(done.accel.fit.parameters[3:6]) > 1e-9))
        factor = _t95(done.accel.fit.freedom + 1.0)
        found += _accel(done.calibration.accel, factor, crossed=crossed)
    if done.calibration.gyro is not None:
        freedom = max(len(done.dwells) - 1.0, 1.0) if done.gyro is None else done.gyro.fit.freedom
        if done.turns is not None:
            freedom = np.inf  # how exactly the angles are known was given
        kept = _kept(done)
        found += _gyro(done.calibration.gyro, _t95(freedom), kept < VAGUE, crossed=done.gyro is not None)
    return tuple(found)


def _accel(accel: AffineCalibration, factor: float, *, crossed: bool) -> list[Parameter]:
    si, degree = accel.unit_in == "m/s^2", float(np.degrees(1.0))
    half = factor * np.sqrt(np.diag(accel.cov)) if accel.cov is not None else np.zeros(12)
    values, gains = np.concatenate([accel.matrix.ravel(), accel.offset]), np.diag(accel.matrix)
    per = "" if si else f"m/s² per {accel.unit_in.removesuffix('s')}"
    rows: list[tuple[str, int, float, str, float | None]] = []
    rows += [(f"gain {axis}", 4 * k, 1.0, per, 1.0 if si else None) for k, axis in enumerate("xyz")]
    for k in (3, 6, 7) if crossed else ():
        rows.append(
            (f"misalignment {'xyz'[k // 3]}{'xyz'[k % 3]}", k, degree / float(gains[k % 3]), "°", 0.0)
        )
    unit = "m/s²" if si else accel.unit_in
    rows += [(f"offset {axis}", 9 + k, 1.0, unit, 0.0 if si else None) for k, axis in enumerate("xyz")]
    found = []
    for name, k, scale, shown, nominal in rows:
        value, spread = float(values[k] * scale), float(half[k] * abs(scale))
        seen = not name.startswith("mis") or spread < factor * VAGUE * np.degrees(Prior().shear)
        limits = (value - spread, value + spread) if spread > 0 else None
        found.append(Parameter("accel", name, value, limits, shown, nominal, bool(seen)))
    return found


def _gyro(
    gyro: AffineCalibration, factor: float, seen: NDArray[np.bool_], *, crossed: bool
) -> list[Parameter]:
    si, degree = gyro.unit_in == "rad/s", float(np.degrees(1.0))
    half = factor * np.sqrt(np.diag(gyro.cov)) if gyro.cov is not None else np.zeros(12)
    values = np.concatenate([gyro.matrix.ravel(), gyro.offset])
    gains = np.diag(gyro.matrix)
    found = []

    def add(name: str, k: int, scale: float, unit: str, nominal: float | None) -> None:
        value, spread = float(values[k] * scale), float(half[k] * abs(scale))
        limits = (value - spread, value + spread) if spread > 0 else None
        found.append(Parameter("gyro", name, value, limits, unit, nominal, bool(seen[k])))

    for k, axis in enumerate("xyz"):
        add(
            f"gain {axis}",
            4 * k,
            1.0,
            "" if si else f"rad/s per {gyro.unit_in.removesuffix('s')}",
            1.0 if si else None,
        )
    for k in (1, 2, 3, 5, 6, 7) if crossed else ():
        name = f"misalignment {'xyz'[k // 3]}{'xyz'[k % 3]}"
        add(name, k, degree / float(gains[k % 3]), "°", 0.0)
    for k, axis in enumerate("xyz"):
        scale, unit = (degree, "°/s") if si else (1.0, gyro.unit_in)
        add(f"offset {axis}", 9 + k, scale, unit, 0.0 if si else None)
    return found


def _kept(done: Calibrated) -> NDArray[np.float64]:
    """What the recording leaves of the prior (12,); the offset's prior is the recording's own rest."""
    kept = np.zeros(12)
    if done.gyro is not None:
        kept[:9] = done.gyro.fit.kept[:9]
    elif done.turns is not None:
        kept[[0, 4, 8]] = done.turns.fit.kept[:3]
    return kept


def _t95(freedom: float) -> float:
    """How many standard deviations hold 95 %."""
    from scipy.special import stdtrit

    return float(stdtrit(min(max(freedom, 1.0), 1e9), 0.975))
