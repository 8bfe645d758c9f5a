"""A landmark in the frame of the body, which is what most readings of landmarks boil down to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, Array, Manifold, Vector, quaternion_inverse, rotate, rotation_matrix
from sequential.manifold.so3 import skew
from sequential.slam.factor_model import FactorModel

__all__ = ["Displacement", "into_body", "into_world", "seen_from"]


def into_body(manifold: Manifold, pose: Array, point: Array) -> Array:
    """Points (..., k) of the world in the frame of bodies (..., n)."""
    if isinstance(manifold, SE2):
        cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        east, north = point[..., 0] - pose[..., 0], point[..., 1] - pose[..., 1]
        return np.stack([cos * east + sin * north, cos * north - sin * east], axis=-1)
    return rotate(quaternion_inverse(pose[..., :4]), point - pose[..., 4:])


def into_world(manifold: Manifold, pose: Array, point: Array) -> Array:
    """Points (..., k) in the frame of bodies (..., n) in the world."""
    if isinstance(manifold, SE2):
        cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        east = pose[..., 0] + cos * point[..., 0] - sin * point[..., 1]
        north = pose[..., 1] + sin * point[..., 0] + cos * point[..., 1]
        return np.stack([east, north], axis=-1)
    return pose[..., 4:] + rotate(pose[..., :4], point)


def seen_from(manifold: Manifold, pose: Array, point: Array) -> tuple[Array, Array, Array]:
    """Points (N, k) in the frame of bodies, and derivatives by pose (N, k, d) and point (N, k, k)."""
    body = into_body(manifold, pose, point)
    if isinstance(manifold, SE2):
        cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        by_pose, by_point = np.zeros((len(body), 2, 3)), np.empty((len(body), 2, 2))
        by_pose[:, 0, 0] = by_pose[:, 1, 1] = -1.0
        by_pose[:, 0, 2], by_pose[:, 1, 2] = body[:, 1], -body[:, 0]
        by_point[:, 0, 0] = by_point[:, 1, 1] = cos
        by_point[:, 0, 1], by_point[:, 1, 0] = sin, -sin
        return body, by_pose, by_point
    by_pose = np.zeros((len(body), 3, 6))
    by_pose[:, :, :3], by_pose[:, :, 3:] = skew(body), -np.eye(3)
    return body, by_pose, np.swapaxes(rotation_matrix(pose[..., :4]), -1, -2)


def require_pose(manifold: Manifold, who: str) -> int:
    """Number of axes of a pose manifold; raises `ModelError` for another one."""
    if not isinstance(manifold, SE2 | SE3):
        msg = f"{who} is read by a pose: SE2() or SE3(); got {manifold!r}"
        raise ModelError(msg)
    return 2 if isinstance(manifold, SE2) else 3


@final
@dataclass(frozen=True)
class Displacement(FactorModel):
    """A landmark's place in the frame of the body: z (N, axes), m; g2o's EDGE_SE2_XY and EDGE_SE3_TRACKXYZ.

    Parameters
    ----------
    pose : `SE2()` or `SE3()`
    body_p_sensor : (axes,) where the sensor stands on the body, its axes along the body's; zero by default

    Raises
    ------
    ModelError
    """

    pose: Manifold = field(default_factory=SE2)
    body_p_sensor: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        axes = require_pose(self.pose, "a Displacement")
        if self.body_p_sensor and len(self.body_p_sensor) != axes:
            msg = f"body_p_sensor of a Displacement is {axes} numbers, got {len(self.body_p_sensor)}"
            raise ModelError(msg)
        object.__setattr__(self, "manifolds", (self.pose, Vector(axes)))
        object.__setattr__(self, "measured", Vector(axes))

    @property
    def arm(self) -> Array:
        """(axes,) where the sensor stands."""
        return np.array(self.body_p_sensor or [0.0] * self.measured.dim)

    def expected(self, *values: Array) -> Array:
        """The landmark in the frame of the sensor."""
        return into_body(self.pose, *values) - self.arm

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose and by the landmark."""
        return seen_from(self.pose, *values)[1:]

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """The landmark, from the pose."""
        if missing == 1 and values[0] is not None:
            return into_world(self.pose, values[0], z + self.arm)
        return super().place(missing, z, *values)
