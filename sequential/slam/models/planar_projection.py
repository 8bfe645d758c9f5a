"""The pixel of a point in space, from a camera on a robot that stays on the floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE2, Array, Vector
from sequential.slam.factor_model import FactorModel
from sequential.slam.models.displacement import into_body, seen_from
from sequential.slam.models.projection import Lens, into_camera, require_mount

__all__ = ["PlanarProjection"]


@final
@dataclass(frozen=True)
class PlanarProjection(FactorModel):
    """The pixel of a landmark: z (N, 2), px; variables world_T_body on SE(2) and a point of space.

    The robot's frame lies on the floor, which is z = 0, with its z axis up.  A point behind the camera has no
    pixel: its error is twice the focal length and does not change, as for a `Projection`.

    Parameters
    ----------
    camera : `vision3d.camera.Camera`, or anything that projects likewise
    body_T_camera : (7,) where the camera stands on the robot
    """

    camera: Lens
    body_T_camera: Sequence[float]
    manifolds = (SE2(), Vector(3))
    measured = Vector(2)

    def __post_init__(self) -> None:
        object.__setattr__(self, "body_T_camera", require_mount(self.body_T_camera, "a PlanarProjection"))

    def in_camera(self, *values: Array) -> Array:
        """The landmark in the frame of the camera: (N, 3)."""
        pose, point = values
        body = np.concatenate([into_body(SE2(), pose, point[..., :2]), point[..., 2:]], axis=-1)
        return into_camera(self.body_T_camera, body)[0]  # type: ignore[arg-type]

    def expected(self, *values: Array) -> Array:
        """The pixel; NaN where there is none."""
        return self.camera.project(np.ascontiguousarray(self.in_camera(*values)))

    def errors(self, z: Array, *values: Array) -> Array:
        """Expected minus read."""
        pixels = self.expected(*values)
        blind = ~np.isfinite(pixels).all(axis=-1, keepdims=True)
        return np.where(blind, 2.0 * self.camera.intrinsics[0], pixels - z)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By the pose (N, 2, 3) and by the landmark (N, 2, 3)."""
        pose, point = values
        level, level_by_pose, level_by_point = seen_from(SE2(), pose, point[:, :2])
        body = np.concatenate([level, point[:, 2:]], axis=1)
        seen, turn = into_camera(self.body_T_camera, body)  # type: ignore[arg-type]
        pixels, slope, _ = self.camera.project_jacobians(np.ascontiguousarray(seen))
        blind: NDArray[np.bool_] = np.asarray(~np.isfinite(pixels).all(axis=-1, keepdims=True))
        slope = np.where(blind[:, :, None], 0.0, slope) @ turn
        by_point = np.concatenate([slope[..., :2] @ level_by_point, slope[..., 2:]], axis=-1)
        return slope[..., :2] @ level_by_pose, by_point
