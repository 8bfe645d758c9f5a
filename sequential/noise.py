"""Noise is declared by its data-sheet quantity and becomes a covariance here and nowhere else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, NotPositiveDefiniteError, ShapeError

__all__ = ["ImuNoise", "diagonal", "require_covariance"]

Array = NDArray[np.float64]

# Kalibr's imu.yaml spells the same four quantities differently.
KALIBR = {
    "gyroscope_noise_density": "gyro_density",
    "accelerometer_noise_density": "accel_density",
    "gyroscope_random_walk": "gyro_bias_walk",
    "accelerometer_random_walk": "accel_bias_walk",
}


@dataclass(frozen=True, slots=True)
class ImuNoise:
    """Continuous-time noise of an inertial sensor, as a data sheet or an Allan plot gives it.

    Parameters
    ----------
    gyro_density : angle random walk, rad/s/√Hz
    accel_density : velocity random walk, m/s²/√Hz
    gyro_bias_walk : rate random walk, rad/s²/√Hz
    accel_bias_walk : m/s³/√Hz
    integration_density : position error of the integration scheme itself, m/√s (GTSAM's integration
        covariance)

    Notes
    -----
    A sample held for dt seconds has the standard deviation density/√dt; a bias walks by walk·√dt.
    """

    gyro_density: float
    accel_density: float
    gyro_bias_walk: float
    accel_bias_walk: float
    integration_density: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not np.isfinite(value) or value < 0:
                msg = f"ImuNoise.{name} is {value}; a density is a finite number, zero or more"
                raise ModelError(msg)

    @classmethod
    def from_kalibr(cls, values: Mapping[str, float]) -> ImuNoise:
        """From the names of Kalibr's `imu.yaml`."""
        missing = [name for name in KALIBR if name not in values]
        if missing:
            msg = f"Kalibr's imu.yaml needs {', '.join(KALIBR)}; missing: {', '.join(missing)}"
            raise ModelError(msg)
        return cls(**{ours: float(values[theirs]) for theirs, ours in KALIBR.items()})

    def scaled(self, factor: float) -> ImuNoise:
        """Accelerometer and gyro densities multiplied together; bias walks untouched."""
        return replace(
            self, gyro_density=self.gyro_density * factor, accel_density=self.accel_density * factor
        )

    def sample_sigmas(self, dt: float) -> tuple[float, float]:
        """Standard deviation of one gyro (rad/s) and one accelerometer sample (m/s²) held for dt seconds."""
        return self.gyro_density / dt**0.5, self.accel_density / dt**0.5


def diagonal(sigmas: ArrayLike) -> Array:
    """Covariance (d, d) from standard deviations (d,)."""
    return np.diag(np.asarray(sigmas, dtype=np.float64) ** 2)


def require_covariance(cov: ArrayLike, dim: int, where: str, *, definite: bool = True) -> Array:
    """`cov` as a read-only (dim, dim) array, or a sentence about what is wrong with it.

    A number stands for that variance on every axis, a vector for a diagonal.

    Raises
    ------
    ShapeError, NotPositiveDefiniteError
    """
    given = np.asarray(cov, dtype=np.float64)
    if given.ndim == 0:
        given = given * np.eye(dim)
    elif given.ndim == 1:
        given = np.diag(given)
    if given.shape != (dim, dim):
        msg = f"{where} must have shape ({dim}, {dim}), got {np.shape(cov)}"
        raise ShapeError(msg)
    if not np.all(np.isfinite(given)):
        msg = f"{where} holds NaN or infinity"
        raise NotPositiveDefiniteError(msg)
    scale = max(float(np.abs(given).max()), 1e-300)
    if np.abs(given - given.T).max() > 1e-9 * scale:
        msg = f"{where} is not symmetric: largest difference {np.abs(given - given.T).max():.3g}"
        raise NotPositiveDefiniteError(msg)
    own = (given + given.T) / 2
    sigmas = np.sqrt(np.clip(np.diag(own), 0, None))
    scaling = np.where(sigmas > 0, sigmas, 1.0)
    lowest = float(np.linalg.eigvalsh(own / np.outer(scaling, scaling)).min())
    if lowest < -1e-10 or (definite and (lowest <= 0 or not (np.diag(own) > 0).all())):
        what = "positive definite" if definite else "positive semi-definite"
        msg = f"{where} is not {what}: smallest eigenvalue {float(np.linalg.eigvalsh(own).min()):.3g}"
        raise NotPositiveDefiniteError(msg)
    own.flags.writeable = False
    return own
