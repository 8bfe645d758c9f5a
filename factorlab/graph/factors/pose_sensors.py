"""Native factors of what is read on a body in space: one place for every graph whose bodies are Pose3.

`pose_factor(sensor, body)` makes the maker of a factor, or None where GTSAM has none: the whole problem then
takes the batched route.  New sensors register themselves.

Costs are those of the batched route everywhere.  Where a reading is itself a rotation or a pose, GTSAM
differentiates its logarithm at the residual and our rows at zero, so that their Jacobians part by half the
residual: a hundredth for one of a degree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import singledispatch
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.keys import L, V, X
from factorlab.graph.native import noise_model
from sequential.manifold import rotation_matrix
from sequential.manifold.quaternion import quaternion_inverse, quaternion_multiply
from sequential.model import SensorModel
from sequential.models import (
    Barometer,
    CameraProjection,
    Direction,
    Magnetometer,
    Orientation,
    PoseReading,
    Position,
    StereoPixels,
    Velocity,
    ZeroVelocity,
)

__all__ = ["Body", "Maker", "pose3", "pose_factor", "seen_landmarks"]

Array = NDArray[np.float64]
Maker = Callable[[int, Array, int], Any]
"""(node, reading, first number of its context) -> factor."""

ROUND_TRIP_M = 1e-6  # a height must survive GTSAM's barometric formula to this


@dataclass(frozen=True)
class Body:
    """What a sensor finds in a graph: pose X(k), perhaps velocity V(k), further parts by their keys."""

    part: str | None = None  # name of the pose's part, where the state has parts
    velocity: bool = False
    first: int = 0  # number of the sensor's first landmark
    others: Mapping[str, Callable[[int], int]] = field(default_factory=dict)


@singledispatch
def pose_factor(sensor: SensorModel, body: Body) -> Maker | None:
    """Maker of the native factor of a sensor, or None."""
    return None


def seen_landmarks(sensor: SensorModel) -> list[Array]:
    """Landmarks that a sensor needs as variables."""
    return list(np.asarray(sensor.landmarks)) if isinstance(sensor, CameraProjection | StereoPixels) else []


def pose3(x: Array) -> Any:
    """`gtsam.Pose3` of a state that begins with quaternion and position."""
    return gtsam.Pose3(gtsam.Rot3.Quaternion(x[0], x[1], x[2], x[3]), x[4:7])


def fits(sensor: Any, body: Body) -> bool:
    """Whether the sensor speaks of this body, and has no gate: GTSAM knows none."""
    return sensor.gate is None and sensor.part in {None, body.part}


@pose_factor.register
def _(sensor: Position, body: Body) -> Maker | None:
    if sensor.axes != 3 or not fits(sensor, body):
        return None
    model = noise_model(sensor.noise_cov, sensor.loss)
    arm = np.zeros(3)
    arm[: len(sensor.lever_arm)] = sensor.lever_arm
    if sensor.arm is not None:
        if arm.any() or sensor.arm not in body.others:
            return None
        key = body.others[sensor.arm]
        return lambda k, z, i: gtsam.GPSFactorArmCalib(X(k), key(k), z, model)  # noqa: ARG005
    if arm.any():
        return lambda k, z, i: gtsam.GPSFactorArm(X(k), z, arm, model)  # noqa: ARG005
    return lambda k, z, i: gtsam.GPSFactor(X(k), z, model)  # noqa: ARG005


@pose_factor.register
def _(sensor: Barometer, body: Body) -> Maker | None:
    if sensor.up != 1.0 or sensor.bias is None or sensor.bias not in body.others or not fits(sensor, body):
        return None
    key, model = body.others[sensor.bias], noise_model(sensor.noise_cov, sensor.loss)
    atmosphere = gtsam.BarometricFactor()

    def make(k: int, z: Array, i: int) -> Any:
        pressure = atmosphere.baroOut(float(z[0]))
        factor = gtsam.BarometricFactor(X(k), key(k), pressure, model)
        if abs(factor.measurementIn() - z[0]) > ROUND_TRIP_M:
            msg = f"GTSAM's atmosphere has no height {z[0]:.1f} m; use route='batched'"
            raise ValueError(msg)
        return factor

    return make


@pose_factor.register
def _(sensor: Direction, body: Body) -> Maker | None:
    return field_factor(sensor, body, np.asarray(sensor.world_v), np.array([1.0, 0.0, 0.0, 0.0]))


@pose_factor.register
def _(sensor: Magnetometer, body: Body) -> Maker | None:
    if sensor.bias is not None:
        return None  # GTSAM's factors know the bias or the attitude
    return field_factor(sensor, body, np.asarray(sensor.world_field), np.asarray(sensor.body_q_sensor))


def field_factor(sensor: Any, body: Body, field_v: Array, mount: Array) -> Maker | None:
    """A vector of the world in the sensor's axes; GTSAM is told of it in the body's."""
    if not fits(sensor, body):
        return None
    turn, scale, none = rotation_matrix(mount), float(np.linalg.norm(field_v)), np.zeros(3)
    model, along = noise_model(turn @ np.asarray(sensor.noise_cov) @ turn.T, sensor.loss), field_v / scale
    return lambda k, z, i: gtsam.MagPoseFactorPose3(X(k), turn @ z, scale, along, none, model)  # noqa: ARG005


@pose_factor.register(Velocity)
@pose_factor.register(ZeroVelocity)
def _(sensor: Velocity | ZeroVelocity, body: Body) -> Maker | None:
    if not (body.velocity and fits(sensor, body)):
        return None
    model = noise_model(sensor.noise_cov, sensor.loss)
    return lambda k, z, i: gtsam.PriorFactorVector(V(k), z, model)  # noqa: ARG005


@pose_factor.register
def _(sensor: Orientation, body: Body) -> Maker | None:
    if sensor.mount is not None or sensor.reference is not None or not fits(sensor, body):
        return None
    mount: Array = sensor.fixed_mount  # type: ignore[attr-defined]
    turn, back = rotation_matrix(mount), quaternion_inverse(mount)
    # an error in the sensor's axes is one in the body's, turned by the mount
    model = noise_model(turn @ np.asarray(sensor.noise_cov) @ turn.T, sensor.loss)

    def make(k: int, z: Array, i: int) -> Any:
        return gtsam.PoseRotationPrior3D(X(k), gtsam.Rot3.Quaternion(*quaternion_multiply(z, back)), model)

    return make


@pose_factor.register
def _(sensor: PoseReading, body: Body) -> Maker | None:
    if sensor.planar or sensor.mount is not None or not fits(sensor, body):
        return None
    mount = pose3(sensor.fixed_mount)  # type: ignore[attr-defined]
    adjoint, back = mount.AdjointMap(), mount.inverse()
    model = noise_model(adjoint @ np.asarray(sensor.noise_cov) @ adjoint.T, sensor.loss)
    return lambda k, z, i: gtsam.PriorFactorPose3(X(k), pose3(z).compose(back), model)  # noqa: ARG005


@pose_factor.register
def _(sensor: CameraProjection, body: Body) -> Maker | None:
    if not fits(sensor, body):
        return None
    fx, fy, cx, cy = map(float, sensor.intrinsics)
    camera, mount = gtsam.Cal3_S2(fx, fy, 0.0, cx, cy), pose3(np.asarray(sensor.body_T_camera))
    model, first = noise_model(sensor.noise_cov, sensor.loss), body.first
    return lambda k, z, i: gtsam.GenericProjectionFactorCal3_S2(z, model, X(k), L(first + i), camera, mount)


@pose_factor.register
def _(sensor: StereoPixels, body: Body) -> Maker | None:
    if not (sensor.shared_row and fits(sensor, body)):
        return None  # GTSAM's stereo point has one row
    fx, fy, cx, cy = map(float, sensor.intrinsics)
    camera = gtsam.Cal3_S2Stereo(fx, fy, 0.0, cx, cy, sensor.baseline)
    model, mount = noise_model(sensor.noise_cov, sensor.loss), pose3(np.asarray(sensor.body_T_camera))
    first = body.first
    return lambda k, z, i: gtsam.GenericStereoFactor3D(
        gtsam.StereoPoint2(*z), model, X(k), L(first + i), camera, mount
    )
