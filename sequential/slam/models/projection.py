"""Pixels of a point whose place is unknown, from a camera on a body: one camera, or a rectified pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, final

import numpy as np

from sequential.errors import ModelError
from sequential.manifold import SE3, Array, Vector, rotate, rotation_matrix
from sequential.slam.factor_model import FactorModel
from sequential.slam.models.displacement import into_body, into_world, seen_from

__all__ = ["Lens", "Projection", "StereoProjection"]

NEAR = 1e-6  # m: what is closer, or behind, has no pixel


class Lens(Protocol):
    """What is asked of a camera; `vision3d.camera.Camera` is one."""

    @property
    def intrinsics(self) -> Array:
        """(4,) fx, fy, cx, cy, px."""
        ...

    def project(self, points_camera: Array) -> Array:
        """(N, 2) px of points (N, 3); NaN where there is no pixel."""
        ...

    def project_jacobians(self, points_camera: Array) -> tuple[Array, Array, Any]:
        """Pixels, and their derivatives by the point (N, 2, 3)."""
        ...


def require_mount(mount: Sequence[float] | None, who: str) -> tuple[float, ...] | None:
    """A pose as seven numbers, normalised; None stays None; raises `ModelError`."""
    if mount is None:
        return None
    pose = np.asarray(mount, dtype=np.float64)
    if pose.shape != (7,) or not np.isfinite(pose).all() or not np.linalg.norm(pose[:4]) > 0:
        msg = f"body_T_camera of {who} is qw qx qy qz px py pz, seven finite numbers; got {mount!r}"
        raise ModelError(msg)
    return tuple(SE3().normalize(pose).tolist())


def into_camera(mount: tuple[float, ...] | None, body: Array) -> tuple[Array, Array | None]:
    """Points (..., 3) of the body in the frame of its camera, and the rotation (3, 3) that turned them."""
    if mount is None:
        return body, None
    pose = np.array(mount)
    return into_body(SE3(), pose, body), rotation_matrix(pose[:4]).T


@final
@dataclass(frozen=True)
class Projection(FactorModel):
    """The pixel of a landmark: z (N, 2), px; variables world_T_body on SE(3) and a point of the world.

    A point behind the camera has no pixel: its error is twice the focal length and does not change, so that
    it stays out of the way until others have moved it (GTSAM's rule too).

    Parameters
    ----------
    camera : `vision3d.camera.Camera`, or anything that projects likewise
    body_T_camera : (7,) where the camera stands on the body; None where the body is the camera
    """

    camera: Lens
    body_T_camera: Sequence[float] | None = None
    manifolds = (SE3(), Vector(3))
    measured = Vector(2)

    def __post_init__(self) -> None:
        object.__setattr__(self, "body_T_camera", require_mount(self.body_T_camera, "a Projection"))

    def in_camera(self, *values: Array) -> Array:
        """The landmark in the frame of the camera: (N, 3)."""
        return into_camera(self.body_T_camera, into_body(SE3(), *values))[0]  # type: ignore[arg-type]

    def expected(self, *values: Array) -> Array:
        """The pixel; NaN where there is none."""
        return self.camera.project(np.ascontiguousarray(self.in_camera(*values)))

    def errors(self, z: Array, *values: Array) -> Array:
        """Expected minus read."""
        pixels = self.expected(*values)
        blind = ~np.isfinite(pixels).all(axis=-1, keepdims=True)
        return np.where(blind, 2.0 * self.camera.intrinsics[0], pixels - z)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose and by the landmark."""
        body, by_pose, by_point = seen_from(SE3(), *values)
        seen, turn = into_camera(self.body_T_camera, body)  # type: ignore[arg-type]
        pixels, slope, _ = self.camera.project_jacobians(np.ascontiguousarray(seen))
        slope = np.where(np.isfinite(pixels).all(axis=-1).reshape(-1, 1, 1), slope, 0.0)
        slope = slope if turn is None else slope @ turn
        return slope @ by_pose, slope @ by_point


@final
@dataclass(frozen=True)
class StereoProjection(FactorModel):
    """A landmark in a rectified pair: z (N, 3) column on the left, on the right, and the common row, px.

    Parameters
    ----------
    intrinsics : fx, fy, cx, cy of both cameras, px
    baseline_m : how far the right camera stands to the right of the left one
    body_T_camera : (7,) where the left camera stands on the body; None where the body is that camera

    Raises
    ------
    ModelError
    """

    intrinsics: tuple[float, float, float, float]
    baseline_m: float
    body_T_camera: Sequence[float] | None = None
    manifolds = (SE3(), Vector(3))
    measured = Vector(3)

    def __post_init__(self) -> None:
        own = tuple(float(value) for value in self.intrinsics)
        if len(own) != 4 or not (min(own[:2]) > 0 and self.baseline_m > 0):
            msg = (
                "a StereoProjection takes fx, fy, cx, cy with positive focal lengths and a positive "
                f"baseline, got {self.intrinsics} and {self.baseline_m}"
            )
            raise ModelError(msg)
        object.__setattr__(self, "intrinsics", own)
        object.__setattr__(self, "body_T_camera", require_mount(self.body_T_camera, "a StereoProjection"))

    @classmethod
    def of_rig(cls, rig: Any, body_T_camera: Sequence[float] | None = None) -> StereoProjection:
        """From a rectified `vision3d.stereo.rig.StereoRig`: no distortion, one camera beside the other.

        Raises
        ------
        ModelError
            for a rig that is not rectified.
        """
        left, right = rig.left, rig.right
        bent = np.any(left.distortion) or np.any(right.distortion)
        turned = rig.angle_rad > 1e-9 or np.abs(rig.centre_of_right[1:]).max() > 1e-9 * rig.baseline_m
        if bent or turned or not np.array_equal(left.intrinsics, right.intrinsics):
            msg = "a StereoProjection needs a rectified rig; rectify it first (vision3d.stereo.rectification)"
            raise ModelError(msg)
        return cls(tuple(left.intrinsics), float(rig.centre_of_right[0]), body_T_camera)

    def in_camera(self, *values: Array) -> Array:
        """The landmark in the frame of the left camera: (N, 3)."""
        return into_camera(self.body_T_camera, into_body(SE3(), *values))[0]  # type: ignore[arg-type]

    def expected(self, *values: Array) -> Array:
        """Both columns and the row; NaN behind the cameras."""
        return self._pixels(self.in_camera(*values))

    def _pixels(self, p: Array) -> Array:
        fx, fy, cx, cy = self.intrinsics
        depth = np.where(p[..., 2] > NEAR, p[..., 2], np.nan)
        columns = [cx + fx * p[..., 0] / depth, cx + fx * (p[..., 0] - self.baseline_m) / depth]
        return np.stack([*columns, cy + fy * p[..., 1] / depth], axis=-1)

    def errors(self, z: Array, *values: Array) -> Array:
        """Expected minus read; twice the focal length behind the cameras."""
        pixels = self.expected(*values)
        blind = ~np.isfinite(pixels).all(axis=-1, keepdims=True)
        return np.where(blind, 2.0 * self.intrinsics[0], pixels - z)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose and by the landmark."""
        body, by_pose, by_point = seen_from(SE3(), *values)
        p, turn = into_camera(self.body_T_camera, body)  # type: ignore[arg-type]
        fx, fy, _, _ = self.intrinsics
        ahead = p[:, 2] > NEAR
        inverse = np.where(ahead, 1.0 / np.where(ahead, p[:, 2], 1.0), 0.0)
        slope = np.zeros((len(p), 3, 3))
        slope[:, 0, 0] = slope[:, 1, 0] = fx * inverse
        slope[:, 2, 1] = fy * inverse
        slope[:, 0, 2] = -fx * p[:, 0] * inverse**2
        slope[:, 1, 2] = -fx * (p[:, 0] - self.baseline_m) * inverse**2
        slope[:, 2, 2] = -fy * p[:, 1] * inverse**2
        slope = slope if turn is None else slope @ turn
        return slope @ by_pose, slope @ by_point

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """The landmark, from the pose and the disparity.

        Raises
        ------
        ModelError
            also for a disparity that is not positive: the point is too far to be placed.
        """
        disparity = z[:, 0] - z[:, 1]
        if missing != 1 or values[0] is None or not (disparity > 0).all():
            return super().place(missing, z, *values)
        fx, fy, cx, cy = self.intrinsics
        depth = fx * self.baseline_m / disparity
        seen = np.stack([(z[:, 0] - cx) / fx, (z[:, 2] - cy) / fy, np.ones(len(z))], axis=-1) * depth[:, None]
        if self.body_T_camera is not None:
            mount = np.array(self.body_T_camera)
            seen = mount[4:] + rotate(mount[:4], seen)
        return into_world(SE3(), values[0], seen)
