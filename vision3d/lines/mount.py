"""Where a camera sits on a robot.

The robot's frame lies on the ground under its centre: x forward, y to the left, z up.  A camera that looks
level along x has its own x to the right and its own y down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply, rotation_matrix
from sequential.manifold.so3 import skew
from vision3d.rigid import compose, inverse

__all__ = ["CameraMount", "planar_pose", "plane_homography"]

Array = NDArray[np.float64]
LEVEL = np.array([0.5, -0.5, 0.5, -0.5])  # camera z is forward, x is right, y is down


@dataclass(frozen=True, slots=True)
class CameraMount:
    """Height and angles of a camera on a robot.

    Attributes
    ----------
    height_m : of the optical centre above the ground
    pitch_rad : downwards from the horizon; pi / 2 looks straight down
    roll_rad : about the optical axis, clockwise as the camera sees the robot turn under it
    forward_m, left_m : of the optical centre from the robot's centre
    yaw_rad : of the optical axis to the left of straight ahead
    """

    height_m: float
    pitch_rad: float
    roll_rad: float = 0.0
    forward_m: float = 0.0
    left_m: float = 0.0
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        if not self.height_m > 0:
            raise ModelError(
                f"a camera hangs above the ground: height_m must be positive, got {self.height_m}"
            )

    @property
    def pose(self) -> Array:
        """The pose robot_T_camera, (7,)."""
        yawed = quaternion_multiply(quaternion_exp(np.array([0.0, 0.0, self.yaw_rad])), LEVEL)
        pitched = quaternion_multiply(yawed, quaternion_exp(np.array([-self.pitch_rad, 0.0, 0.0])))
        attitude = quaternion_multiply(pitched, quaternion_exp(np.array([0.0, 0.0, self.roll_rad])))
        return np.concatenate([attitude, [self.forward_m, self.left_m, self.height_m]])

    def world_pose(self, world_T_robot: Array) -> Array:
        """The pose camera_T_world (7,) for a robot somewhere in the world."""
        return inverse(compose(world_T_robot, self.pose))


def planar_pose(x_m: float, y_m: float, heading_rad: float) -> Array:
    """The pose (7,) of something that stands on the ground and has turned to the left by `heading_rad`."""
    half = 0.5 * heading_rad
    return np.array([np.cos(half), 0.0, 0.0, np.sin(half), x_m, y_m, 0.0])


def plane_homography(ground_T_camera: Array) -> tuple[Array, Array]:
    """The map from rays (x/z, y/z, 1) of a camera to where they meet z = 0, and how it changes.

    Returns
    -------
    tuple
        ground_H_camera (3, 3), whose third row is positive below the horizon, and the derivatives (9, 6) of
        its elements, row by row, by the pose: right exponential, rotation then translation.
    """
    rotation, place = rotation_matrix(ground_T_camera[:4]), ground_T_camera[4:]
    jacobian = np.zeros((9, 6))
    for k, axis in enumerate(np.eye(3)):
        turn = rotation @ skew(axis)
        jacobian[:, k] = (-_meeting(turn, place)).ravel()
        jacobian[:6, 3 + k] = -_meeting(rotation, rotation[:, k])[:2].ravel()
    return -_meeting(rotation, place), jacobian


def _meeting(rotation: Array, place: Array) -> Array:
    """Linear in the rotation, and in the place but for its last row."""
    x, y, z = place
    return np.array([x * rotation[2] - z * rotation[0], y * rotation[2] - z * rotation[1], rotation[2]])
