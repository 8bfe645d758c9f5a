"""Stereo rigs whose truth is known."""

import numpy as np

from sequential.manifold.quaternion import quaternion_exp
from vision3d.camera import Camera
from vision3d.stereo import StereoRig

SIZE = (640, 480)
LEFT = Camera("brown5", (533.0, 531.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0006, 0.16), SIZE)
RIGHT = Camera("brown5", (536.0, 535.0, 327.0, 250.0), (-0.29, 0.06, 0.0009, -0.0003, 0.05), SIZE)
FISH = (
    Camera("fisheye4", (240.0, 239.0, 322.0, 236.0), (-0.02, 0.01, -0.004, 0.0005), SIZE),
    Camera("fisheye4", (242.0, 241.0, 318.0, 241.0), (-0.018, 0.008, -0.003, 0.0004), SIZE),
)


def rig_of(rotation=(0.010, 0.022, -0.006), translation=(-0.083, 0.0011, 0.0007), left=LEFT, right=RIGHT):
    """A rig by its rotation vector, rad, and its translation, m."""
    return StereoRig(left, right, np.concatenate([quaternion_exp(np.array(rotation)), translation]))


SIDE_BY_SIDE = rig_of()
VERTICAL = rig_of((0.02, -0.01, 0.005), (0.0011, -0.12, 0.002))
SWAPPED = rig_of((0.01, -0.02, 0.004), (0.09, 0.002, -0.001))
FISHEYES = rig_of((0.01, 0.03, -0.02), (-0.1, 0.002, 0.004), *FISH)
CONVERGING = rig_of((0.0, 0.35, 0.0), (-0.4, 0.0, 0.07))
EVERY_RIG = {
    "side by side": SIDE_BY_SIDE,
    "vertical": VERTICAL,
    "swapped": SWAPPED,
    "fisheyes": FISHEYES,
    "converging": CONVERGING,
}


def seen_by_both(rig, rng, count=400, near_m=0.5, far_m=5.0):
    """Points (N, 3) of the left frame that both cameras see, and their pixels in both."""
    pixels = rng.uniform(0.0, np.array(rig.left.size) - 1.0, (4 * count, 2))
    rays = rig.left.unproject(pixels)
    rays = rays[rays[:, 2] > 0.4]  # within 66° of the axis, which a plane can show
    points = rays * rng.uniform(near_m, far_m, (len(rays), 1))
    left, right = rig.project(points)
    inside = np.isfinite(left).all(axis=1) & (right >= 0).all(axis=1)
    inside &= (right <= np.array(rig.right.size) - 1).all(axis=1)
    return points[inside][:count], left[inside][:count], right[inside][:count]
