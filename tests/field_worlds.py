"""A magnetometer among soft and hard iron, and the directions that a hand turns it in."""

import numpy as np

from sequential.sensors import ImuRecording

ROOT = np.array([[1 / 50, -4e-4, 0.0], [-4e-4, 1 / 42, 5e-4], [0.0, 5e-4, 1 / 46]])  # 1/µT
CENTRE = np.array([12.0, -30.0, 5.0])


def sphere(count, rng):
    d = rng.standard_normal((count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def points(count, rng, *, sigma=0.5, directions=None, root=ROOT):
    unit = sphere(count, rng) if directions is None else directions
    return unit @ np.linalg.inv(root) + CENTRE + sigma * rng.standard_normal((len(unit), 3))


def smooth_turns(count, rng, *, planar=False):
    """Directions of a sensor that turns smoothly, as a recording has them."""
    t = np.arange(count) * 0.02
    if planar:
        return np.stack([np.cos(1.3 * t), np.sin(1.3 * t), np.zeros(count)], axis=1)
    z = np.sin(0.11 * t + 0.3 * np.sin(0.02 * t))
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(1.7 * t), r * np.sin(1.7 * t), z], axis=1)


def recording(mag, unit="uT"):
    return ImuRecording(np.arange(len(mag)) * 0.02, mag=mag, mag_unit=unit, name="turns")
