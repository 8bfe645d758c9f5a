"""Markers at known poses: corners with noise, and the pose that belongs to them."""

import numpy as np

from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply, rotate
from vision3d.camera import Camera
from vision3d.markers import marker_corners

SIZE_M = 0.1
PINHOLE = Camera("pinhole", (800.0, 800.0, 640.0, 360.0), (), (1280, 720))


def tilted(side_px, tilt_deg, rng, camera=PINHOLE, size_m=SIZE_M, at=(0.0, 0.0)):
    """camera_T_marker of a marker `side_px` long in the image, tilted about a random axis, spun at random.

    `at` is where it is, as tangents of the angles from the optical axis.
    """
    azimuth, spin = rng.uniform(0.0, 2.0 * np.pi, 2)
    sight = np.array([*at, 1.0]) / np.sqrt(1.0 + at[0] ** 2 + at[1] ** 2)
    axis = np.cross([0.0, 0.0, 1.0], sight)
    sine = np.linalg.norm(axis)
    facing = quaternion_exp(axis * (np.arcsin(sine) / sine if sine > 0.0 else 1.0))
    tilt = quaternion_exp(np.radians(tilt_deg) * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
    turned = quaternion_multiply(
        facing, quaternion_multiply(tilt, quaternion_exp(np.array([0.0, 0.0, spin])))
    )
    return np.concatenate([turned, sight * camera.intrinsics[0] * size_m / side_px])


def corners_of(camera, camera_T_marker, size_m=SIZE_M):
    """Exact pixels of the four corners."""
    return camera.project(rotate(camera_T_marker[:4], marker_corners(size_m)) + camera_T_marker[4:])


def swaying(rng, side_px=32.0):
    """A marker that turns smoothly about tilts at which one picture decides little."""
    start = tilted(side_px, 25.0, rng)
    phase, rate = rng.uniform(0.0, 2.0 * np.pi, 3), np.array([2.0, 2.7, 1.3])
    size = np.array([0.25, 0.25, 0.1])
    return lambda t: SE3().retract(start, np.concatenate([size * np.sin(rate * t + phase), np.zeros(3)]))
