"""What a gyro reads at rest: its bias, how well that is known, and what gravity does to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.dwells import Dwells

__all__ = ["GyroAtRest", "bias_at_rest"]

Array = NDArray[np.float64]
DOUBT = 1e-3  # probability that a gyro which does not feel gravity is said to


@dataclass(frozen=True, slots=True, eq=False)
class GyroAtRest:
    """Reading at rest in the recording's unit: `bias + g_sensitivity @ specific force`.

    The earth's 0.004 °/s is in it: a recording in one place cannot tell it from bias.

    Parameters
    ----------
    bias, cov : (3,) and (3, 3)
    drift : (3,) standard deviation from dwell to dwell beyond the noise
    g_sensitivity : (3, 3) per m/s², or None where the dwells do not show one
    probability : that dwells of a gyro which does not feel gravity look like these
    residual : (K, 3) mean of each dwell less what is expected
    """

    bias: Array
    cov: Array
    drift: Array
    g_sensitivity: Array | None
    probability: float
    residual: Array


def bias_at_rest(dwells: Dwells, force: Array | None = None) -> GyroAtRest:
    """Weighted mean over the dwells, the scatter between them counted in.

    Parameters
    ----------
    force : (K, 3) calibrated accelerometer at rest, m/s²; with eight dwells or more, a dependence on it
        is tried, and kept where chance would give it in one recording of a thousand

    Raises
    ------
    DataError
        where there is no gyro.
    """
    if dwells.gyro is None or dwells.gyro_cov is None:
        raise DataError(f"recording {dwells.name!r} has no gyro")
    noise = np.diagonal(dwells.gyro_cov, axis1=1, axis2=2)
    ones = np.ones((len(dwells), 1))
    probability, chosen, design = 1.0, _weighted(dwells.gyro, noise, ones), ones
    if force is not None and len(dwells) >= 8:
        wide = np.hstack([ones, force])
        probability = _chance(dwells.gyro, noise, wide)
        if probability < DOUBT:
            chosen, design = _weighted(dwells.gyro, noise, wide), wide
    coefficients, covs, drift = chosen
    return GyroAtRest(
        coefficients[0],
        np.diag(covs[:, 0, 0]),
        drift,
        coefficients[1:].T if len(coefficients) > 1 else None,
        probability,
        dwells.gyro - design @ coefficients,
    )


def _weighted(values: Array, noise: Array, design: Array) -> tuple[Array, Array, Array]:
    """Coefficients (p, 3), their covariances (3, p, p) and the scatter (3,) beyond the noise, axis by axis.

    The scatter is what makes the weighted squares equal their number (Paule and Mandel, 1982).
    """
    count, width = design.shape
    found, covs, drift = np.empty((width, 3)), np.empty((3, width, width)), np.zeros(3)
    for axis in range(3):
        low, high = 0.0, float(np.var(values[:, axis])) + 1e-300
        extra, normal = high, np.eye(width)
        for _ in range(60):
            extra = (low + high) / 2
            weight = 1 / (noise[:, axis] + extra + 1e-300)
            normal = design.T @ (weight[:, None] * design)
            found[:, axis] = np.linalg.solve(normal, design.T @ (weight * values[:, axis]))
            squares = weight @ (values[:, axis] - design @ found[:, axis]) ** 2
            low, high = (extra, high) if squares > count - width else (low, extra)
        covs[axis], drift[axis] = np.linalg.inv(normal), np.sqrt(extra)
    return found, covs, drift


def _chance(values: Array, noise: Array, design: Array) -> float:
    """Probability of so large a gain in squares by chance: an F test over the three axes together."""
    from scipy.special import fdtrc

    count, width = design.shape
    weight = 1 / (noise + _weighted(values, noise, design[:, :1])[2] ** 2 + 1e-300)
    gained = 0.0
    for axis in range(3):
        root = np.sqrt(weight[:, axis])
        squares = []
        for columns in (1, width):
            part = design[:, :columns] * root[:, None]
            fitted = np.linalg.lstsq(part, root * values[:, axis], rcond=None)[0]
            squares.append(float(np.sum((root * values[:, axis] - part @ fitted) ** 2)))
        gained += (squares[0] - squares[1]) / max(squares[1], 1e-300) * (count - width)
    degrees = 3 * (width - 1)
    return float(fdtrc(degrees, 3 * (count - width), gained / degrees))
