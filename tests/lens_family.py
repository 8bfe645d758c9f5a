"""One plausible camera of every lens, and points that it sees."""

import numpy as np

from vision3d.camera import LENSES, Camera

INTRINSICS = (532.8, 531.9, 342.5, 233.9)
DISTORTION = {
    "pinhole": (),
    "brown1": (-0.2,),
    "brown2": (-0.281, 0.1),
    "brown4": (-0.281, 0.12, 0.0012, -0.0009),
    "brown5": (-0.281, 0.025, 0.0012, -0.0009, 0.163),
    "rational8": (-0.1, 0.02, 0.001, -0.002, 0.003, 0.15, 0.02, 0.001),
    "thin12": (-0.1, 0.02, 0.001, -0.002, 0.003, 0.15, 0.02, 0.001, 0.001, -0.002, 0.003, -0.0005),
    "fisheye4": (0.02, -0.01, 0.003, -0.0005),
}


def camera_of(lens, size=(640, 480)):
    """The family's camera with this lens."""
    return Camera(lens, INTRINSICS, DISTORTION[lens], size)


EVERY_CAMERA = [camera_of(lens) for lens in LENSES]


def points_seen(camera, rng, count=200):
    """Points (N, 3), m, from 0.3 to 3 m, whose images lie in and a little around the image."""
    width, height = camera.size
    pixels = rng.uniform((-20.0, -20.0), (width + 20.0, height + 20.0), (count, 2))
    rays = camera.unproject(pixels)
    return rays[np.isfinite(rays[:, 0])] * rng.uniform(0.3, 3.0, (int(np.isfinite(rays[:, 0]).sum()), 1))
