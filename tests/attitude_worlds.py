"""Motions without noise of their own, and what perfect sensors say of them."""

import numpy as np

from sequential.attitude import attitude_from_angles
from sequential.manifold.quaternion import quaternion_inverse, quaternion_log, quaternion_multiply, rotate
from sequential.sensors import ImuRecording

RATE = 100.0
FIELD = np.array([0.0, 22.0, -42.0])


def swinging(seconds=20.0, rate=RATE):
    """Angles (N, 3) of a slow motion, at rest for the first two seconds, with their stamps in seconds."""
    t = np.arange(0, seconds, 1 / rate)
    grow = np.clip((t - 2) / 2, 0, 1) ** 2 * (3 - 2 * np.clip((t - 2) / 2, 0, 1))
    angles = np.column_stack([0.5 * np.sin(0.9 * t), 0.4 * np.sin(0.7 * t + 1), 0.8 * np.sin(0.5 * t)])
    return t, angles * grow[:, None] + [0.2, -0.1, 0.7]


def seen(t, world_q_body, *, mag=True, bias=(0.0, 0.0, 0.0), rng=None):
    """What perfect sensors say of these orientations, with or without noise."""
    body_q_world = quaternion_inverse(world_q_body)
    steps = quaternion_log(quaternion_multiply(quaternion_inverse(world_q_body[:-1]), world_q_body[1:]))
    gyro = np.vstack([steps[:1], steps]) / np.diff(t, prepend=2 * t[0] - t[1])[:, None] + bias
    accel = rotate(body_q_world, np.array([0.0, 0.0, 9.81]))
    field = rotate(body_q_world, FIELD)
    if rng is not None:
        gyro = gyro + 2e-3 * rng.normal(size=gyro.shape)
        accel = accel + 0.05 * rng.normal(size=accel.shape)
        field = field + 0.3 * rng.normal(size=field.shape)
    return ImuRecording(t, accel, gyro, field if mag else None)


def still(angles, seconds=30.0, **options):
    t = np.arange(0, seconds, 1 / RATE)
    return seen(t, np.tile(attitude_from_angles(angles), (len(t), 1)), **options)
