"""A robot with two driven wheels, a gyro, and a camera of 40 rows by 60 columns that looks at the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vision3d.camera import Camera
from vision3d.lines import CameraMount, GroundHomography
from vision3d.render.ground_view import GroundView

__all__ = ["CAMERA", "MOUNT", "PERIOD_S", "TRACK_M", "Drivetrain", "along_arc", "between", "ground", "view"]

Array = NDArray[np.float64]
PERIOD_S = 0.05  # of the camera and of the controller
TRACK_M = 0.12  # between the wheels
LAG_S = 0.06  # time constant of the motors
FASTEST = 1.2  # m/s of a wheel
CAMERA = Camera("pinhole", (50.0, 50.0, 29.5, 19.5), (), (60, 40))
MOUNT = CameraMount(height_m=0.15, pitch_rad=float(np.radians(40.0)), forward_m=0.05)


@cache
def view() -> GroundView:
    """What the camera sees."""
    return GroundView(CAMERA, MOUNT)


@cache
def ground() -> GroundHomography:
    """From its pixels to metres, in the robot's frame."""
    return GroundHomography.from_camera(CAMERA, MOUNT)


def along_arc(pose: Array, length_m: float, turn_rad: float) -> Array:
    """(3,) the pose after an arc of a circle."""
    half = 0.5 * turn_rad
    chord = length_m * (math.sin(half) / half if abs(half) > 1e-6 else 1.0)
    angle = float(pose[2]) + half
    return np.array(
        [pose[0] + chord * math.cos(angle), pose[1] + chord * math.sin(angle), pose[2] + turn_rad]
    )


def between(first: Array, second: Array) -> Array:
    """(3,) the second pose as seen from the first."""
    c, s = math.cos(first[2]), math.sin(first[2])
    dx, dy = second[0] - first[0], second[1] - first[1]
    return np.array([c * dx + s * dy, c * dy - s * dx, second[2] - first[2]])


@dataclass(frozen=True, slots=True)
class Drivetrain:
    """Both wheels' speeds, m/s, which follow what is asked of them with a lag."""

    left: float = 0.0
    right: float = 0.0

    @property
    def speed_m_s(self) -> float:
        """Of the robot."""
        return 0.5 * (self.left + self.right)

    @property
    def rate_rad_s(self) -> float:
        """Turn rate of the robot, to the left."""
        return (self.right - self.left) / TRACK_M

    def after(self, speed_m_s: float, rate_rad_s: float) -> Drivetrain:
        """Mean speeds over the next period, under a command."""
        share = 1.0 - math.exp(-PERIOD_S / LAG_S)
        aside = 0.5 * TRACK_M * rate_rad_s
        wanted = (min(max(speed_m_s + way * aside, -FASTEST), FASTEST) for way in (-1.0, 1.0))
        left, right = (
            now + share * (goal - now) for now, goal in zip((self.left, self.right), wanted, strict=True)
        )
        return Drivetrain(left, right)
