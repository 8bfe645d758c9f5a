"""What every attitude estimator returns: orientations with what is known about them, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.log import frozen, nanoseconds, seconds

__all__ = ["AttitudeHistory", "read_only"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

SHAPES: dict[str, tuple[int, ...]] = {
    "world_q_body": (4,),
    "heading_free": (4,),
    "cov": (3, 3),
    "cov_6d": (3, 3),
    "gyro_bias": (3,),
    "gyro_bias_cov": (3, 3),
    "rest": (),
    "magnetic_disturbance": (),
}


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeHistory:
    """Orientation over time.

    The world is ENU: x east, y (magnetic) north, z up.  Quaternions are (w, x, y, z), Hamilton, and turn body
    coordinates into world coordinates.  A covariance belongs to δ in R = R̂ exp(δ), the body (right) chart.
    Arrays are copied, unless they are read-only already (see `read_only`).

    Parameters
    ----------
    t : (N,) stamps, ns
    world_q_body : (N, 4); of an estimator without magnetometer the heading counts from an arbitrary direction
    heading_free : (N, 4) the answer without magnetometer of an estimator that gives both
    cov, cov_6d : (N, 3, 3) covariance of `world_q_body` and of `heading_free`, rad²
    gyro_bias : (N, 3) rad/s, what the gyro reads when it does not turn
    gyro_bias_cov : (N, 3, 3) rad²/s²
    rest : (N,) where the estimator held the sensor to be at rest
    magnetic_disturbance : (N,) where it did not trust the magnetometer
    name : of the estimator

    Raises
    ------
    ShapeError
        where an array has not one row a stamp of the shape above.
    """

    t: NDArray[np.int64]
    world_q_body: Array
    heading_free: Array | None = None
    cov: Array | None = None
    cov_6d: Array | None = None
    gyro_bias: Array | None = None
    gyro_bias_cov: Array | None = None
    rest: Flags | None = None
    magnetic_disturbance: Flags | None = None
    name: str = "attitude"

    def __post_init__(self) -> None:
        t = np.asarray(self.t)
        if t.dtype != np.int64 or t.flags.writeable:
            t = nanoseconds(t).copy()
            t.flags.writeable = False
        object.__setattr__(self, "t", t)
        for field in fields(self):
            given = getattr(self, field.name)
            if field.name in SHAPES and given is not None:
                object.__setattr__(self, field.name, self._sealed(field.name, given))

    def _sealed(self, name: str, given: Array | Flags) -> Array | Flags:
        """One field, read-only, after a look at its shape."""
        shape = (len(self.t), *SHAPES[name])
        if np.shape(given) != shape:
            raise ShapeError(
                f"AttitudeHistory.{name} has shape {shape} for {len(self.t)} stamps, got {np.shape(given)}"
            )
        if isinstance(given, np.ndarray) and _is_sealed(given, np.float64 if SHAPES[name] else np.bool_):
            return given
        if not SHAPES[name]:
            flags = np.array(given, dtype=np.bool_)
            flags.flags.writeable = False
            return flags
        return frozen(given)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def seconds(self) -> Array:
        """(N,) seconds since the first stamp."""
        return seconds(self.t, int(self.t[0]) if len(self.t) else 0)

    def roll_pitch_yaw(self) -> Array:
        """(N, 3) rad: R = Rz(yaw) Ry(pitch) Rx(roll); yaw counts from east, counter-clockwise."""
        from sequential.attitude.angles import roll_pitch_yaw

        return roll_pitch_yaw(self.world_q_body)

    def roll_pitch_yaw_sigmas(self) -> Array | None:
        """(N, 3) standard deviations of roll, pitch and yaw, rad, to first order; None without `cov`."""
        from sequential.attitude.angles import euler_rates

        if self.cov is None:
            return None
        rates = euler_rates(self.roll_pitch_yaw())
        variances: Array = np.einsum("nij,njk,nik->ni", rates, self.cov, rates)
        return np.sqrt(variances)


def read_only(*arrays: Array | Flags | None) -> None:
    """Seal arrays that nobody else holds, so that a history takes them without a copy."""
    for array in arrays:
        if array is not None:
            array.flags.writeable = False


def _is_sealed(array: NDArray[np.generic], kind: type[np.generic]) -> bool:
    return array.dtype == kind and array.flags.c_contiguous and not array.flags.writeable
