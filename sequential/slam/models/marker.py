"""The four corners of a square marker of unknown pose, in a camera: eight numbers a sighting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from sequential.errors import ModelError
from sequential.manifold import SE3, Array, Vector, quaternion_from_matrix, rotation_matrix
from sequential.manifold.so3 import skew
from sequential.slam.factor_model import FactorModel
from sequential.slam.models.displacement import into_body, into_world
from sequential.slam.models.groups import compose, inverse
from sequential.slam.models.projection import into_camera, require_mount

__all__ = ["MarkerCorners", "square_corners"]

POLISHING = 10  # Gauss-Newton steps that follow the homography


def square_corners(side_m: float) -> Array:
    """(4, 3) corners in the marker's frame, as detectors order them: x right, y down, from the top left."""
    h = side_m / 2
    return np.array([[-h, -h, 0.0], [h, -h, 0.0], [h, h, 0.0], [-h, h, 0.0]])


@final
@dataclass(frozen=True)
class MarkerCorners(FactorModel):
    """Corners of a marker: z (N, 8), px, u v of each; variables world_T_body and world_T_marker.

    Parameters
    ----------
    camera : `vision3d.camera.Camera`, or anything that projects and unprojects likewise
    side_m : of the marker
    body_T_camera : (7,) where the camera stands on the body; None where the body is the camera

    Raises
    ------
    ModelError
        for a side that is not positive.
    """

    camera: Any
    side_m: float
    body_T_camera: Sequence[float] | None = None
    manifolds = (SE3(), SE3())
    measured = Vector(8)

    def __post_init__(self) -> None:
        if not self.side_m > 0:
            msg = f"the side of a marker is positive, in metres; got {self.side_m}"
            raise ModelError(msg)
        object.__setattr__(self, "body_T_camera", require_mount(self.body_T_camera, "MarkerCorners"))

    def expected(self, *values: Array) -> Array:
        """The pixels; NaN where a corner has none."""
        seen = self._seen(*values)[0]
        pixels: Array = self.camera.project(np.ascontiguousarray(seen.reshape(-1, 3)))
        return pixels.reshape(len(seen), 8)

    def errors(self, z: Array, *values: Array) -> Array:
        """Expected minus read, twice the focal length for a corner behind the camera."""
        pixels = self.expected(*values)
        blind = ~np.isfinite(pixels)
        return np.where(blind, 2.0 * self.camera.intrinsics[0], pixels - z)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the body and by the marker."""
        seen, body, turn, corners = self._seen(*values)
        count = len(seen)
        pixels, slope, _ = self.camera.project_jacobians(np.ascontiguousarray(seen.reshape(-1, 3)))
        blind = ~np.isfinite(pixels).all(axis=-1, keepdims=True)
        slope = np.where(blind[..., None], 0.0, slope).reshape(count, 4, 2, 3)
        slope = slope if turn is None else slope @ turn
        by_body = np.concatenate([slope @ skew(body), -slope], axis=-1)
        turned = rotation_matrix(values[0][:, :4]).swapaxes(-1, -2) @ rotation_matrix(values[1][:, :4])
        slope = slope @ turned[:, None]
        by_marker = np.concatenate([-slope @ skew(corners), slope], axis=-1)
        return by_body.reshape(count, 8, 6), by_marker.reshape(count, 8, 6)

    def _seen(self, *values: Array) -> tuple[Array, Array, Array | None, Array]:
        """Corners in the camera's and the body's frames (N, 4, 3), the turn between, and in the marker's."""
        corners = square_corners(self.side_m)
        world = into_world(SE3(), values[1][:, None], corners)
        body = into_body(SE3(), values[0][:, None], world)
        seen, turn = into_camera(self.body_T_camera, body)  # type: ignore[arg-type]
        return seen, body, turn, corners

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """The marker from the body, or the body from the marker: the better of the two poses of a square.

        Four corners of a small square fit two poses nearly as well; where that matters, choose between
        `vision3d.markers.MarkerPose.modes` and give the value in `SlamProblem.start`.
        """
        other = values[1 - missing]
        if other is None:
            return super().place(missing, z, *values)
        mount = SE3().identity() if self.body_T_camera is None else np.array(self.body_T_camera)
        body_T_marker = compose(SE3(), np.broadcast_to(mount, (len(z), 7)), self.seen_pose(z))
        if missing == 1:
            return compose(SE3(), other, body_T_marker)
        return compose(SE3(), other, inverse(SE3(), body_T_marker))

    def seen_pose(self, z: Array) -> Array:
        """(N, 7) poses of least reprojection error of sightings (N, 8)."""
        alone = MarkerCorners(self.camera, self.side_m)
        rays = self.camera.undistort_points(z.reshape(-1, 2)).reshape(len(z), 4, 2)
        first = _plane_pose(rays, square_corners(self.side_m)[:, :2])
        best, least = first, np.full(len(z), np.inf)
        for start in (first, _mirrored(first)):
            pose, cost = alone._polished(z, start)
            better = cost < least
            best, least = np.where(better[:, None], pose, best), np.where(better, cost, least)
        return best

    def _polished(self, z: Array, pose: Array) -> tuple[Array, Array]:
        """Poses after Gauss-Newton steps that are kept only where they help, and their squared errors."""
        here = np.broadcast_to(SE3().identity(), pose.shape)
        error = self.errors(z, here, pose)
        for _ in range(POLISHING):
            slope = self.jacobians(z, here, pose)[1]
            normal = slope.swapaxes(-1, -2) @ slope + 1e-9 * np.eye(6)
            step = np.linalg.solve(normal, slope.swapaxes(-1, -2) @ error[..., None])[..., 0]
            trial = SE3().retract(pose, -np.asarray(step, dtype=np.float64))
            reached = self.errors(z, here, trial)
            helps = (np.square(reached).sum(1) < np.square(error).sum(1))[:, None]
            pose, error = np.where(helps, trial, pose), np.where(helps, reached, error)
        return pose, np.square(error).sum(1)


def _plane_pose(rays: Array, corners: Array) -> Array:
    """(N, 7) poses of four points of a plane (4, 2) seen along normalised rays (N, 4, 2): homographies."""
    count = len(rays)
    x, y = np.broadcast_to(corners.T[:, None], (2, count, 4))
    u, v = rays[..., 0], rays[..., 1]
    one, none = np.ones_like(u), np.zeros_like(u)
    rows = np.concatenate(
        [
            np.stack([x, y, one, none, none, none, -u * x, -u * y], axis=-1),
            np.stack([none, none, none, x, y, one, -v * x, -v * y], axis=-1),
        ],
        axis=1,
    )
    h = np.linalg.solve(rows, np.concatenate([u, v], axis=1)[..., None])[..., 0]
    matrix = np.concatenate([h, np.ones((count, 1))], axis=1).reshape(count, 3, 3)
    scale = np.sqrt(np.linalg.norm(matrix[..., 0], axis=-1) * np.linalg.norm(matrix[..., 1], axis=-1))
    matrix = matrix / scale[:, None, None]
    frame = np.stack([matrix[..., 0], matrix[..., 1], np.cross(matrix[..., 0], matrix[..., 1])], axis=-1)
    left, _, right = np.linalg.svd(frame)
    turn = left @ np.stack([right[:, 0], right[:, 1], right[:, 2] * np.linalg.det(left @ right)[:, None]], 1)
    return np.concatenate([quaternion_from_matrix(turn), matrix[..., 2]], axis=-1)


def _mirrored(pose: Array) -> Array:
    """The other pose that a small square could have: its normal mirrored about the line of sight."""
    sight = pose[:, 4:] / np.linalg.norm(pose[:, 4:], axis=-1, keepdims=True)
    turn = rotation_matrix(pose[:, :4])
    normal = turn[..., 2]
    other = 2.0 * np.sum(normal * sight, axis=-1, keepdims=True) * sight - normal
    axis = np.cross(normal, other)
    cosine = np.sum(normal * other, axis=-1)[:, None, None]
    cross = skew(axis)
    rotate = np.eye(3) + cross + cross @ cross / np.maximum(1.0 + cosine, 1e-6)
    return np.concatenate([quaternion_from_matrix(rotate @ turn), pose[:, 4:]], axis=-1)
