"""Two cameras fixed to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, NotFiniteError, ShapeError
from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_from_matrix, rotation_matrix
from sequential.manifold.so3 import skew
from vision3d.camera import Camera
from vision3d.rigid import transform

__all__ = ["StereoRig"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StereoRig:
    """A left and a right camera, and where they are to each other.

    Parameters
    ----------
    left, right : the cameras
    right_T_left : (7,) qw qx qy qz px py pz: points of the left camera's frame in the right one's, m
    joint_cov : (6 + p + q, 6 + p + q) covariance of `right_T_left` (rotation, then translation, in the left
        camera's frame: ``right_T_left * Exp(η)``), of the parameters of the left camera (p) and of the right
        one (q); (6, 6) stands for cameras known exactly; None where nobody knows

    Raises
    ------
    ShapeError, NotFiniteError
        where arrays do not go together, or hold NaN or infinity.
    ModelError
        where both cameras are in one place.
    """

    left: Camera
    right: Camera
    right_T_left: Array
    joint_cov: Array | None = None

    def __post_init__(self) -> None:
        pose = np.array(self.right_T_left, dtype=np.float64)
        if pose.shape != (7,):
            raise ShapeError(f"right_T_left is (7,) qw qx qy qz px py pz, got shape {pose.shape}")
        if not np.isfinite(pose).all():
            raise NotFiniteError(f"right_T_left is seven finite numbers, got {pose.tolist()}")
        if not pose[:4].any() or not np.linalg.norm(pose[4:]) > 0.0:
            raise ModelError("the two cameras of a rig stand apart and have a rotation; this has none")
        object.__setattr__(self, "right_T_left", _frozen(SE3().normalize(pose)))
        if self.joint_cov is None:
            return
        cov = np.array(self.joint_cov, dtype=np.float64)
        count = 6 + self.left.count + self.right.count
        if cov.shape == (6, 6):
            cov = np.pad(cov, (0, count - 6))
        if cov.shape != (count, count):
            raise ShapeError(
                f"the covariance of a rig is (6, 6) of its pose, or ({count}, {count}) with both cameras' "
                f"parameters, got {cov.shape}"
            )
        if not np.isfinite(cov).all():
            raise NotFiniteError("the covariance of a rig is finite")
        object.__setattr__(self, "joint_cov", _frozen(cov))

    @classmethod
    def from_opencv(cls, left: Camera, right: Camera, R: Array, T: Array) -> StereoRig:
        """A rig from OpenCV's R (3, 3) and T (3,): ``x_right = R x_left + T``."""
        quaternion = quaternion_from_matrix(np.asarray(R, dtype=np.float64).reshape(3, 3))
        shift = np.asarray(T, dtype=np.float64).reshape(3)
        return cls(left, right, np.concatenate([quaternion, shift]))

    @property
    def cov(self) -> Array | None:
        """Covariance of `right_T_left`, (6, 6); None where nobody knows."""
        return None if self.joint_cov is None else self.joint_cov[:6, :6]

    @cached_property
    def R(self) -> Array:  # noqa: N802 - OpenCV's name
        """(3, 3): turns directions of the left frame into the right one's; read-only."""
        return _frozen(rotation_matrix(self.right_T_left[:4]))

    @property
    def T(self) -> Array:  # noqa: N802 - OpenCV's name
        """(3,) where the left camera stands in the right one's frame, m."""
        return self.right_T_left[4:]

    @property
    def baseline_m(self) -> float:
        """Distance of the cameras."""
        return float(np.linalg.norm(self.T))

    @cached_property
    def centre_of_right(self) -> Array:
        """(3,) where the right camera stands in the left one's frame, m; read-only."""
        return _frozen(-self.R.T @ self.T)

    @property
    def baseline_std_m(self) -> float | None:
        """Its standard deviation."""
        if self.cov is None:
            return None
        # right_T_left Exp(η) moves the translation by R ρ
        along = self.R.T @ self.T / self.baseline_m
        return float(np.sqrt(along @ self.cov[3:, 3:] @ along))

    @property
    def angle_rad(self) -> float:
        """Angle of the rotation between the cameras."""
        return 2.0 * float(np.arctan2(np.linalg.norm(self.right_T_left[1:4]), abs(self.right_T_left[0])))

    @property
    def is_vertical(self) -> bool:
        """Whether the cameras stand above each other rather than side by side."""
        centre = np.abs(self.centre_of_right)
        return bool(centre[1] > centre[0])

    @property
    def is_swapped(self) -> bool:
        """Whether the camera called right stands on the left (of a vertical rig: above)."""
        return bool(self.centre_of_right[int(self.is_vertical)] < 0.0)

    @cached_property
    def essential(self) -> Array:
        """(3, 3) E with ``ray_right' E ray_left = 0``; read-only."""
        return _frozen(skew(self.T) @ self.R)

    def swapped(self) -> StereoRig:
        """The rig with its cameras exchanged."""
        from vision3d.rigid import inverse

        cov = None
        if self.joint_cov is not None:
            p, q = self.left.count, self.right.count
            # (T Exp(η))⁻¹ = T⁻¹ Exp(-Ad(T) η)
            identity = SE3().identity()
            adjoint, _ = SE3().transport(identity, inverse(self.right_T_left))
            turn = np.zeros((6 + p + q, 6 + p + q))
            turn[:6, :6] = -adjoint
            turn[6 : 6 + q, 6 + p :] = np.eye(q)
            turn[6 + q :, 6 : 6 + p] = np.eye(p)
            cov = turn @ self.joint_cov @ turn.T
        return StereoRig(self.right, self.left, inverse(self.right_T_left), cov)

    def resized(self, size: Sequence[int]) -> StereoRig:
        """The rig of its images after they were scaled to (width, height), both alike."""
        left, right = self.left.resized(size), self.right.resized(size)
        if self.joint_cov is None:
            return StereoRig(left, right, self.right_T_left)
        scale = np.ones(len(self.joint_cov))
        for camera, at in ((self.left, 6), (self.right, 6 + self.left.count)):
            ratio = np.array(size, dtype=np.float64) / camera.size
            scale[at : at + 4] = [*ratio, *ratio]
        return StereoRig(left, right, self.right_T_left, self.joint_cov * scale[:, None] * scale)

    def project(self, points_left: Array) -> tuple[Array, Array]:
        """Pixels (N, 2) in both images of points (N, 3) of the left camera's frame, m."""
        points = np.asarray(points_left, dtype=np.float64)
        return self.left.project(points), self.right.project(transform(self.right_T_left, points))

    def __repr__(self) -> str:
        return (
            f"StereoRig({self.left!r}, {self.right!r}, baseline {1e3 * self.baseline_m:.2f} mm, turned by "
            f"{np.degrees(self.angle_rad):.2f}°)"
        )


def _frozen(array: Array) -> Array:
    array.flags.writeable = False
    return array
