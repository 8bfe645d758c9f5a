"""A filter's belief in the gauge of a map: relative to the reference marker, heading and place held."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.filter_steps import Body
from sequential.manifold import (
    SE3,
    quaternion_exp,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
    rotation_matrix,
)
from vision3d.rigid import compose

__all__ = ["held_at"]

Array = NDArray[np.float64]
MANIFOLD = SE3()
STEP = 1e-6


def held_at(body: Body, marker: Array, P: Array, held: Array) -> tuple[Array, Array, Array]:
    """Pose (7,), covariance (15, 15) and velocity (3,) of a body, the world moved so that a marker is held.

    Parameters
    ----------
    marker : (7,) as believed; P (21, 21) joint covariance of body and marker
    held : (7,) pose of the marker in the map, of which place and heading count
    """
    steps = STEP * np.vstack([np.eye(15)[:9], -np.eye(15)[:9]])
    turned = quaternion_normalize(quaternion_multiply(body.pose[:4], quaternion_exp(steps[:, :3])))
    poses = np.concatenate([turned, body.pose[4:] + steps[:, 3:6]], axis=1)
    by_body = _differences(*_moved(poses, body.velocity + steps[:, 6:9], np.tile(marker, (18, 1)), held))
    steps = STEP * np.vstack([np.eye(6), -np.eye(6)])
    markers = MANIFOLD.retract(np.tile(marker, (12, 1)), steps)
    still = np.tile(body.pose, (12, 1)), np.tile(body.velocity, (12, 1))
    by_marker = _differences(*_moved(*still, markers, held))
    J = np.zeros((15, 21))
    J[:9, :9], J[:9, 15:] = by_body, by_marker
    J[9:, 9:15] = np.eye(6)
    cov = J @ P @ J.T
    (pose,), (velocity,) = _moved(body.pose[None], body.velocity[None], marker[None], held)
    return pose, 0.5 * (cov + cov.T), velocity


def _moved(poses: Array, velocities: Array, markers: Array, held: Array) -> tuple[Array, Array]:
    """Turn by the heading and shift by the place that bring each marker to where it is held."""
    turn = rotation_matrix(held[:4]) @ rotation_matrix(markers[:, :4]).transpose(0, 2, 1)
    yaw = np.arctan2(turn[:, 1, 0] - turn[:, 0, 1], turn[:, 0, 0] + turn[:, 1, 1])
    heading = quaternion_exp(np.column_stack([np.zeros_like(yaw), np.zeros_like(yaw), yaw]))
    shift = np.concatenate([heading, held[4:] - rotate(heading, markers[:, 4:])], axis=1)
    return compose(shift, poses), rotate(heading, velocities)


def _differences(poses: Array, velocities: Array) -> Array:
    """(9, d) central differences of pose and velocity over pairs of steps."""
    half = len(poses) // 2
    moved = MANIFOLD.local(poses[half:], poses[:half])
    return np.hstack([moved, velocities[:half] - velocities[half:]]).T / (2 * STEP)
