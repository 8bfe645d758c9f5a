"""All corners of all markers in one pass: whitened errors and their Jacobians, for any lens.

The error is GTSAM's, `projected - measured`, of eight numbers a sighting, white by the whole covariance of
its corners; steps are those of `SE3`, on the right.  A pose behind the camera or beyond the fold of the lens
has no pixel: its error is then one of `LOST` sigmas and its rows are zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import rotation_matrix
from vision3d.markers.sightings import MarkerSightings

__all__ = ["CornerRows"]

Array = NDArray[np.float64]
LOST = 1e3


@dataclass(frozen=True, eq=False)
class CornerRows:
    """Sightings made ready; `body_T_camera` (7,) is where the camera sits in the body.

    Parameters
    ----------
    sightings : what was seen
    body_T_camera : (7,)
    whitening : (S, 8, 8) inverse Cholesky factors of the covariances
    """

    sightings: MarkerSightings
    body_T_camera: Array
    whitening: Array

    @classmethod
    def of(cls, sightings: MarkerSightings, body_T_camera: Array) -> CornerRows:
        """Factor the covariances once."""
        factor = np.linalg.cholesky(sightings.cov)
        return cls(sightings, body_T_camera, np.linalg.inv(factor))

    def only(self, rows: NDArray[np.int64]) -> CornerRows:
        """Those of some sightings."""
        kept = np.zeros(len(self.sightings), dtype=np.bool_)
        kept[rows] = True
        return CornerRows(self.sightings.keep(kept), self.body_T_camera, self.whitening[rows])

    def errors(self, frames: Array, markers: Array) -> Array:
        """(S, 8) whitened; `frames` (S, 7) world_T_body and `markers` (S, 7) world_T_marker of each."""
        pixels = self.sightings.camera.project(self._in_camera(frames, markers)[0])
        return self._white(pixels)

    def linearised(self, frames: Array, markers: Array) -> tuple[Array, Array, Array]:
        """Whitened errors (S, 8), and Jacobians (S, 8, 6) by steps of the body and of the marker."""
        inside, R_body, R_marker, R_mount, in_body = self._in_camera(frames, markers)
        pixels, d_point, _ = self.sightings.camera.project_jacobians(inside)
        error = self._white(pixels)
        lost = ~np.isfinite(pixels).all(axis=(1, 2))
        d_point[lost] = 0.0
        by_body = d_point @ R_mount.T  # (S, 4, 2, 3): pixel by point in the body
        turn = by_body @ _skew(in_body)
        frame = np.concatenate([turn, -by_body], axis=-1)
        by_marker = by_body @ (R_body.transpose(0, 2, 1) @ R_marker)[:, None]
        marker = np.concatenate([-by_marker @ _skew(self.sightings.points), by_marker], axis=-1)
        count = len(error)
        return (
            error,
            self.whitening @ frame.reshape(count, 8, 6),
            self.whitening @ marker.reshape(count, 8, 6),
        )

    def in_camera(self, frames: Array, markers: Array) -> Array:
        """Corners (S, 4, 3) in the camera's axes, m."""
        return self._in_camera(frames, markers)[0]

    def _in_camera(self, frames: Array, markers: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Corners in the camera (S, 4, 3), the rotations on the way, corners in the body."""
        R_body, R_marker = rotation_matrix(frames[:, :4]), rotation_matrix(markers[:, :4])
        R_mount = rotation_matrix(self.body_T_camera[:4])
        in_world = self.sightings.points @ R_marker.transpose(0, 2, 1) + markers[:, None, 4:]
        in_body = (in_world - frames[:, None, 4:]) @ R_body
        return (in_body - self.body_T_camera[4:]) @ R_mount, R_body, R_marker, R_mount, in_body

    def _white(self, pixels: Array) -> Array:
        error = (pixels - self.sightings.corners).reshape(-1, 8)
        white: Array = np.einsum("sij,sj->si", self.whitening, error)
        white[~np.isfinite(white).all(axis=1)] = LOST
        return white


def _skew(v: Array) -> Array:
    """(..., 3, 3) cross product matrices."""
    matrix = np.zeros((*v.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -v[..., 2], v[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = v[..., 2], -v[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -v[..., 1], v[..., 0]
    return matrix
