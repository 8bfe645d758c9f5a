"""Odometry and sightings whose scales, and whose sensor's place on the robot, are variables as well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.manifold import SE2, SO2, Array, Product, Vector
from sequential.slam.factor_model import FactorModel
from sequential.slam.models.displacement import into_world, seen_from
from sequential.slam.models.groups import between, compose, inverse

__all__ = ["MountedRangeBearing", "ScaledOdometry"]

NEAR = 1e-9  # m: closer than this there is no direction to a landmark
PLANE = SE2()


@final
@dataclass(frozen=True)
class ScaledOdometry(FactorModel):
    """Motion in the plane by wheels that misjudge it: variables pose, next pose, scale.

    The robot's speed is really (1 + scale[0]) times what the wheels say, its turn rate (1 + scale[1]) times.
    A step is taken as one arc, so it should turn by a fraction of a radian only.
    """

    manifolds = (SE2(), SE2(), Vector(2))
    measured = SE2()

    def expected(self, *values: Array) -> Array:
        """The motion as the wheels should tell it."""
        twist = PLANE.local(PLANE.identity(), between(PLANE, values[0], values[1]))
        return PLANE.retract(np.zeros_like(twist), twist / _gain(values[2]))

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose, the next pose and the scale."""
        moved = between(PLANE, values[0], values[1])
        gain, origin = _gain(values[2]), np.zeros_like(moved)
        twist = PLANE.local(origin, moved)
        told = PLANE.retract(origin, twist / gain)
        by_told = np.linalg.inv(PLANE.transport(z, told)[1]) @ PLANE.transport(origin, told)[1]
        by_next = (by_told / gain[:, None, :]) @ np.linalg.inv(PLANE.transport(origin, moved)[1])
        by_pose = -by_next @ PLANE.transport(values[0], values[1])[0]
        shrink = -by_told * (twist / gain**2)[:, None, :]
        by_scale = np.stack([shrink[..., 0] + shrink[..., 1], shrink[..., 2]], axis=-1)
        return by_pose, by_next, by_scale

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """Either pose from the other."""
        if values[2] is None:
            return super().place(missing, z, *values)
        twist = PLANE.local(np.zeros_like(z), z) * _gain(values[2])
        moved = PLANE.retract(np.zeros_like(z), twist)
        if missing == 1 and values[0] is not None:
            return compose(PLANE, values[0], moved)
        if missing == 0 and values[1] is not None:
            return compose(PLANE, values[1], inverse(PLANE, moved))
        return super().place(missing, z, *values)


@final
@dataclass(frozen=True)
class MountedRangeBearing(FactorModel):
    """Range (m) and bearing (rad) from a sensor of unknown place: variables pose, landmark, sensor.

    The sensor's variable is (x, y, heading, scale): it sits at x, y (m) on the robot and looks along heading
    (rad); it reads (1 + scale) times the distance.  One vector, because GTSAM joins no more than three
    variables without a factor of its own.
    """

    manifolds = (SE2(), Vector(2), Vector(4))
    measured = Product(range=Vector(1), bearing=SO2())

    def expected(self, *values: Array) -> Array:
        """Range and bearing."""
        pose, landmark, sensor = values
        seen = seen_from(PLANE, compose(PLANE, pose, sensor[:, :3]), landmark)[0]
        distance = (1.0 + sensor[:, 3]) * np.linalg.norm(seen, axis=-1)
        return np.stack([distance, np.arctan2(seen[:, 1], seen[:, 0])], axis=-1)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By pose, landmark and sensor."""
        pose, landmark, sensor = values
        eye = compose(PLANE, pose, sensor[:, :3])
        seen, by_eye, by_point = seen_from(PLANE, eye, landmark)
        distance = np.maximum(np.linalg.norm(seen, axis=-1), NEAR)
        unit = seen / distance[:, None]
        across = np.stack([-unit[:, 1], unit[:, 0]], axis=-1) / distance[:, None]
        polar = np.stack([(1.0 + sensor[:, 3:]) * unit, across], axis=-2)
        carried = PLANE.transport(pose, eye)[0]  # a step of the body, in the axes of the sensor
        by_sensor = np.zeros((len(pose), 2, 4))
        cos, sin = np.cos(sensor[:, 2]), np.sin(sensor[:, 2])
        into_eye = np.stack([np.stack([cos, sin], axis=-1), np.stack([-sin, cos], axis=-1)], axis=-2)
        by_eye = polar @ by_eye
        by_sensor[..., :2], by_sensor[..., 2] = by_eye[..., :2] @ into_eye, by_eye[..., 2]
        by_sensor[:, 0, 3] = distance
        return by_eye @ carried, polar @ by_point, by_sensor

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """The landmark, from the others."""
        pose, _, sensor = values
        if missing != 1 or pose is None or sensor is None:
            return super().place(missing, z, *values)
        distance = z[:, 0] / (1.0 + sensor[:, 3])
        seen = distance[:, None] * np.stack([np.cos(z[:, 1]), np.sin(z[:, 1])], axis=-1)
        return into_world(PLANE, compose(PLANE, pose, sensor[:, :3]), seen)


def _gain(scale: Array) -> Array:
    """(N, 3) factors on the twist."""
    return 1.0 + scale[:, [0, 0, 1]]
