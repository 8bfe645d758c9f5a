"""Ranges and bearings from a pose to a landmark of unknown place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from sequential.manifold import SE2, SO2, Array, Manifold, Product, Vector
from sequential.slam.factor_model import FactorModel
from sequential.slam.models.displacement import into_body, into_world, require_pose, seen_from

__all__ = ["LandmarkBearing", "LandmarkRange", "LandmarkRangeBearing"]

NEAR = 1e-9  # m: closer than this there is no direction to a landmark


@final
@dataclass(frozen=True)
class LandmarkRangeBearing(FactorModel):
    """Range (m) and bearing (rad, left of the body's x axis) to a landmark in the plane: z (N, 2).

    The covariance is in this order too.
    """

    manifolds = (SE2(), Vector(2))
    measured = Product(range=Vector(1), bearing=SO2())

    def expected(self, *values: Array) -> Array:
        """Range and bearing."""
        body = into_body(SE2(), *values)
        return np.stack([_length(body), np.arctan2(body[..., 1], body[..., 0])], axis=-1)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose and by the landmark."""
        body, by_pose, by_point = seen_from(SE2(), *values)
        polar = np.stack([_along(body), _across(body)], axis=-2)
        return polar @ by_pose, polar @ by_point

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """The landmark, from the pose."""
        if missing == 1 and values[0] is not None:
            body = z[:, :1] * np.stack([np.cos(z[:, 1]), np.sin(z[:, 1])], axis=-1)
            return into_world(SE2(), values[0], body)
        return super().place(missing, z, *values)


@final
@dataclass(frozen=True)
class LandmarkRange(FactorModel):
    """Distance to a landmark, m: z (N, 1).

    Parameters
    ----------
    pose : `SE2()` or `SE3()`
    """

    pose: Manifold = field(default_factory=SE2)
    measured = Vector(1)

    def __post_init__(self) -> None:
        axes = require_pose(self.pose, "a LandmarkRange")
        object.__setattr__(self, "manifolds", (self.pose, Vector(axes)))

    def expected(self, *values: Array) -> Array:
        """The distance."""
        return _length(into_body(self.pose, *values))[..., None]

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose and by the landmark."""
        body, by_pose, by_point = seen_from(self.pose, *values)
        row = _along(body)[..., None, :]
        return row @ by_pose, row @ by_point


@final
@dataclass(frozen=True)
class LandmarkBearing(FactorModel):
    """Bearing to a landmark in the plane, rad left of the body's x axis: z (N, 1)."""

    manifolds = (SE2(), Vector(2))
    measured = SO2()

    def expected(self, *values: Array) -> Array:
        """The bearing."""
        body = into_body(SE2(), *values)
        return np.arctan2(body[..., 1], body[..., 0])[..., None]

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose and by the landmark."""
        body, by_pose, by_point = seen_from(SE2(), *values)
        row = _across(body)[..., None, :]
        return row @ by_pose, row @ by_point


def _length(body: Array) -> Array:
    distance: Array = np.linalg.norm(body, axis=-1)
    return distance


def _along(body: Array) -> Array:
    """Derivative of the distance by the displacement."""
    return body / np.maximum(_length(body), NEAR)[..., None]


def _across(body: Array) -> Array:
    """Derivative of the bearing by the displacement."""
    squared: Array = np.maximum(_length(body), NEAR)[..., None] ** 2
    return np.stack([-body[..., 1], body[..., 0]], axis=-1) / squared
