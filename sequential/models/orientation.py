"""A sensor that measures a whole attitude: a marker seen by a camera, motion capture, a star tracker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold import SE3, SO3, Manifold, NavState, rotation_matrix
from sequential.manifold.quaternion import quaternion_inverse, quaternion_multiply
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part, mounted
from sequential.models.rotation import quaternion_product, rotation
from sequential.noise import require_covariance

__all__ = ["Orientation", "marker_attitude"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Orientation(SensorModel):
    """reference_q_sensor = reference_q_world · world_q_body · body_q_sensor, a reading on SO(3).

    Parameters
    ----------
    noise_cov : (3, 3), (3,) variances or a number, rad², about the sensor's axes
    body_q_sensor : (4,) how the sensor is mounted; along the body's axes unless given
    mount : instead, name of an SO(3) part of the state that is body_q_sensor
    reference : name of an SO(3) part that is reference_q_world, where readings are not in the world's axes
    part : name of the SO(3), SE(3) or navigation part that is the body; the first unless given

    Notes
    -----
    Readings whose noise differs from one to the next bring it along: `Stream(t, q, noise_cov=…)`.
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    body_q_sensor: ArrayLike | None = None
    mount: str | None = None
    reference: str | None = None
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        if self.mount is not None and self.body_q_sensor is not None:
            raise ModelError("an Orientation has a body_q_sensor or a mount in the state, not both")
        fixed = mounted(self.body_q_sensor, SO3(), "body_q_sensor of an Orientation")
        object.__setattr__(self, "fixed_mount", fixed)
        object.__setattr__(self, "manifold", SO3())
        cov = require_covariance(self.noise_cov, 3, "the noise_cov of an Orientation")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        fixed: Array = self.fixed_mount  # type: ignore[attr-defined]  # set above
        places = attitude_places(manifold, self.part, self.mount, self.reference, fixed, "Orientation")
        return Functions(attitude, attitude_jacobian, as_params(*places), helpers=HELPERS)


def attitude_places(
    manifold: Manifold, part: str | None, mount: str | None, reference: str | None, fixed: Array, who: str
) -> tuple[ArrayLike, ...]:
    """Parameters 0-12 of a sensor of attitudes.

    Raises
    ------
    ModelError
    """
    storage, tangent, _ = find_part(manifold, (SO3, SE3, NavState), part, who)
    others = []
    for name, what in ((mount, "mount"), (reference, "reference")):
        place = (0, 0, 0)
        if name is not None:
            place = (1, *find_part(manifold, (SO3,), name, f"{who}'s {what}")[:2])
            if place[1] == storage:
                raise ModelError(f"{who}'s {what} {name!r} is the body itself; name another SO(3) part")
        others.append(place)
    return storage, tangent, manifold.dim, *others, fixed


def seen_attitude(x: Any, p: Any) -> tuple[float, float, float, float]:
    """p = [storage, tangent, d, mount (1, storage, tangent), reference (the same), fixed mount (4)]."""
    at = int(p[0])
    w, a, b, c = x[at], x[at + 1], x[at + 2], x[at + 3]
    if p[6] > 0.0:
        k = int(p[7])
        w, a, b, c = quaternion_product(x[k], x[k + 1], x[k + 2], x[k + 3], w, a, b, c)
    if p[3] > 0.0:
        k = int(p[4])
        return quaternion_product(w, a, b, c, x[k], x[k + 1], x[k + 2], x[k + 3])
    return quaternion_product(w, a, b, c, p[9], p[10], p[11], p[12])


def attitude(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """The expected reading."""
    out[0], out[1], out[2], out[3] = seen_attitude(x, p)


def attitude_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Mᵀ on the body, the identity on a mount, (R M)ᵀ on a reference."""
    at, t, d = int(p[0]), int(p[1]), int(p[2])
    for i in range(3 * d):
        out[i] = 0.0
    if p[3] > 0.0:
        k = int(p[4])
        w, a, b, c = x[k], x[k + 1], x[k + 2], x[k + 3]
        for i in range(3):
            out[i * d + int(p[5]) + i] = 1.0
    else:
        w, a, b, c = p[9], p[10], p[11], p[12]
    m = rotation(w, a, b, c)
    for i in range(3):
        for j in range(3):
            out[i * d + t + j] = m[3 * j + i]
    if p[6] > 0.0:
        q = quaternion_product(x[at], x[at + 1], x[at + 2], x[at + 3], w, a, b, c)
        m = rotation(q[0], q[1], q[2], q[3])
        for i in range(3):
            for j in range(3):
                out[i * d + int(p[8]) + j] = m[3 * j + i]


HELPERS = (rotation, quaternion_product, seen_attitude)


def marker_attitude(
    camera_q_marker: ArrayLike, cov: ArrayLike, world_q_marker: ArrayLike | None = None
) -> tuple[Array, Array]:
    """What sightings of a marker of known attitude say about the camera's: readings of an `Orientation`.

    Parameters
    ----------
    camera_q_marker : (N, 4), or the first four numbers of `MarkerPose.camera_T_marker`
    cov : (3, 3) or (N, 3, 3) rad², about the marker's axes: the first block of `MarkerPose.cov`
    world_q_marker : (4,) or (N, 4); without it the marker is the world

    Returns
    -------
    world_q_camera (N, 4), and its covariance (N, 3, 3) about the camera's axes

    Raises
    ------
    ShapeError
    """
    seen = np.atleast_2d(np.asarray(camera_q_marker, dtype=np.float64))
    spread = np.asarray(cov, dtype=np.float64)
    if seen.shape[1:] != (4,) or spread.shape not in {(3, 3), (len(seen), 3, 3)}:
        raise ShapeError(
            f"sightings are quaternions (N, 4) with covariances (3, 3) or (N, 3, 3), got {seen.shape} and "
            f"{spread.shape}"
        )
    back = quaternion_inverse(SO3().normalize(seen))
    if world_q_marker is not None:
        back = quaternion_multiply(np.asarray(world_q_marker, dtype=np.float64), back)
    turn = rotation_matrix(seen)
    return SO3().normalize(back), turn @ spread @ np.swapaxes(turn, 1, 2)
