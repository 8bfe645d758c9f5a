"""Height by air pressure: what a barometer reads, with the bias that the weather gives it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ModelError
from sequential.manifold import SE3, Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part, named_vector
from sequential.models.rotation import rotation
from sequential.noise import require_covariance

__all__ = ["Barometer", "pressure_height"]

SEA_LEVEL_PA = 101_325.0
SCALE_M, EXPONENT = 44_330.77, 0.190_263_2  # T0 / L and R L / (g M) of the standard atmosphere


@dataclass(frozen=True, eq=False)
class Barometer(SensorModel):
    """Height above the world's origin, plus a bias: z = ±p_z + bias, m.

    Parameters
    ----------
    noise_cov : variance, m²
    bias : name of a vector part of one number, m; let it walk (`Strapdown(walks={"bias": 0.02})`) on long
        recordings, since the weather moves a barometer by metres an hour
    up : 1 where the world's z axis points up, -1 where it points down
    axis : which number of a position vector is the height, where the state is no pose
    part : name of the pose, navigation state or position vector; the first that fits unless given

    Notes
    -----
    Readings are heights: `pressure_height` makes them of pressures.
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    bias: str | None = None
    up: float = 1.0
    axis: int = 2
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        if self.up not in {1.0, -1.0}:
            msg = f"Barometer's up is 1 where z points up and -1 where it points down, got {self.up}"
            raise ModelError(msg)
        object.__setattr__(self, "manifold", Vector(1))
        cov = require_covariance(self.noise_cov, 1, "the noise_cov of a Barometer")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        storage, tangent, member = find_part(manifold, (NavState, SE3, Vector), self.part, "Barometer")
        bias = named_vector(manifold, self.bias, 1, "Barometer's bias")
        if isinstance(member, Vector):
            if not 0 <= self.axis < member.size:
                msg = f"Barometer reads number {self.axis} of a position, and {member} has {member.size}"
                raise ModelError(msg)
            place = (storage + self.axis, tangent + self.axis, -1)
        else:
            place = (storage + 6, tangent + 3, storage)
        return Functions(
            height, height_jacobian, as_params(place, manifold.dim, self.up, bias), helpers=HELPERS
        )


def height(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage of the height, tangent, quaternion's storage or -1, d, up, bias (1, storage, tangent)]."""
    out[0] = p[4] * x[int(p[0])]
    if p[5] > 0.0:
        out[0] += x[int(p[6])]


def height_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """The last row of R on the position, whose steps are along the body's axes; one on the bias."""
    t, q = int(p[1]), int(p[2])
    for i in range(int(p[3])):
        out[i] = 0.0
    if q < 0:
        out[t] = p[4]
    else:
        r = rotation(x[q], x[q + 1], x[q + 2], x[q + 3])
        for i in range(3):
            out[t + i] = p[4] * r[6 + i]
    if p[5] > 0.0:
        out[int(p[7])] = 1.0


HELPERS = (rotation,)


def pressure_height(pressure_pa: ArrayLike, sea_level_pa: float = SEA_LEVEL_PA) -> NDArray[np.float64]:
    """Height (m) at which the standard atmosphere has a pressure (ICAO 7488, troposphere).

    Parameters
    ----------
    pressure_pa : (...,) Pa
    sea_level_pa : pressure at sea level today; an error of 100 Pa moves every height by 8 m, alike

    Raises
    ------
    DataError
        where a pressure is outside 20 to 120 kPa: most sensors give hPa, to be multiplied by 100.
    """
    given = np.asarray(pressure_pa, dtype=np.float64)
    low, high = 20e3, 120e3
    if not (np.all((given > low) & (given < high)) and low < sea_level_pa < high):
        worst = given if given.ndim == 0 else given[~((given > low) & (given < high))][:1]
        msg = f"a pressure is 20 to 120 kPa, got {worst} Pa (sea level {sea_level_pa:g}); is it in hPa?"
        raise DataError(msg)
    return SCALE_M * (1.0 - (given / sea_level_pa) ** EXPONENT)
