"""Rectangles, spheres and boxes in the world, each covered with a window of a material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply, rotate
from vision3d.render.material import Material

__all__ = ["WHOLE", "Shape", "box", "rectangle", "sphere"]

Array = NDArray[np.float64]
Window = tuple[float, float, float, float]
WHOLE: Window = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """One surface; made by `rectangle`, `sphere` or `box`.

    Attributes
    ----------
    kind : "rectangle" or "sphere"
    world_T_shape : (7,) of its middle; a rectangle lies in the plane z = 0, x to the right and y down, its
        picture seen from negative z
    size_m : width and height, or a sphere's diameter twice
    material : what covers it
    window : u0, v0, width, height: the part of the material it shows, as shares; more than 1 repeats it
    tint : blue, green, red: what its grey becomes in a colour picture
    name : to find it again
    """

    kind: str
    world_T_shape: Array
    size_m: tuple[float, float]
    material: Material
    window: Window = WHOLE
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    name: str = ""

    def __post_init__(self) -> None:
        pose = np.array(self.world_T_shape, dtype=np.float64)
        if pose.shape != (7,) or not np.isfinite(pose).all():
            raise ShapeError(f"world_T_shape must be seven finite numbers, qw qx qy qz px py pz, got {pose}")
        if not min(self.size_m) > 0.0:
            raise ModelError(f"the size of a shape must be positive, got {self.size_m} m")
        pose.setflags(write=False)
        object.__setattr__(self, "world_T_shape", pose)


def pose_at(position: ArrayLike, rotation_vector: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Pose (7,) from a position (m) and a rotation vector (rad)."""
    return np.concatenate(
        [
            quaternion_exp(np.asarray(rotation_vector, dtype=np.float64)),
            np.asarray(position, dtype=np.float64),
        ]
    )


def rectangle(
    world_T_shape: ArrayLike,
    size_m: tuple[float, float],
    material: Material,
    *,
    window: Window = WHOLE,
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0),
    name: str = "",
) -> Shape:
    """A rectangle: see `Shape`."""
    return Shape("rectangle", np.asarray(world_T_shape), size_m, material, window, tint, name)


def sphere(
    middle: ArrayLike,
    radius_m: float,
    material: Material,
    *,
    rotation_vector: ArrayLike = (0.0, 0.0, 0.0),
    window: Window = WHOLE,
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0),
    name: str = "",
) -> Shape:
    """A sphere: see `Shape`."""
    return Shape(
        "sphere", pose_at(middle, rotation_vector), (2 * radius_m, 2 * radius_m), material, window, tint, name
    )


# The six faces of a box: how each is turned, its normal outwards along the face's own negative z
_QUARTER = np.pi / 2
_FACES = {
    "front": ((0.0, 0.0, 0.0), (0, 1)),
    "back": ((0.0, 2 * _QUARTER, 0.0), (0, 1)),
    "right": ((0.0, -_QUARTER, 0.0), (2, 1)),
    "left": ((0.0, _QUARTER, 0.0), (2, 1)),
    "bottom": ((_QUARTER, 0.0, 0.0), (0, 2)),
    "top": ((-_QUARTER, 0.0, 0.0), (0, 2)),
}


def box(
    world_T_box: ArrayLike,
    size_m: tuple[float, float, float],
    material: Material,
    *,
    windows: Sequence[Window] | None = None,
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0),
    name: str = "box",
) -> tuple[Shape, ...]:
    """Six rectangles about the middle of a box: front (negative z), back, right, left, bottom (y down), top.

    Parameters
    ----------
    world_T_box : (7,) pose of the middle
    size_m : extent along its own x, y and z
    windows : a window of the material for each face; the whole of it by default
    """
    pose = np.asarray(world_T_box, dtype=np.float64)
    shown = [WHOLE] * 6 if windows is None else list(windows)
    if len(shown) != 6:
        raise ModelError(f"a box has six faces, got {len(shown)} windows")
    faces = []
    for (side, (turn, (across, down))), window in zip(_FACES.items(), shown, strict=True):
        attitude = quaternion_exp(np.array(turn))
        third = 3 - across - down
        outwards = rotate(attitude, np.array([0.0, 0.0, -0.5 * size_m[third]]))
        face = np.concatenate(
            [quaternion_multiply(pose[:4], attitude), pose[4:] + rotate(pose[:4], outwards)]
        )
        faces.append(
            Shape("rectangle", face, (size_m[across], size_m[down]), material, window, tint, f"{name} {side}")
        )
    return tuple(faces)
