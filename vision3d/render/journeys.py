"""Where a camera goes in a scene, what it photographs there, and which exact points it should have seen.

poses = orbit_poses((0, 0.1, 1.4), 1.3, 8)
views = render_journey(camera, poses, desk(rng), rng=rng)
points = scene_points(scene, 500, rng)
pixels = observe(camera, poses, scene, points)       # (V, P, 2), NaN where hidden
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from sequential.manifold.quaternion import quaternion_exp, quaternion_from_matrix
from vision3d.render.shapes import Shape
from vision3d.render.solid import RenderedView, Scene, is_seen, render_scene
from vision3d.rigid import inverse, transform

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = [
    "forward_poses",
    "looking_at",
    "observe",
    "orbit_poses",
    "render_journey",
    "scene_points",
    "sideways_poses",
    "turning_poses",
]

Array = NDArray[np.float64]


def looking_at(position: ArrayLike, target: ArrayLike) -> Array:
    """Pose (7,) camera_T_world of a camera at a position (m) that looks at a target, its y as low as can be.

    Raises
    ------
    ModelError
        where the target is straight above or below, or where the camera is.
    """
    place = np.array(position, dtype=np.float64)
    ahead = np.array(target, dtype=np.float64) - place
    across = np.cross((0.0, 1.0, 0.0), ahead)
    if not np.linalg.norm(across) > 1e-9 * np.linalg.norm(ahead):
        raise ModelError(
            f"a camera at {place} that looks at {place + ahead} has no upright; move either aside"
        )
    z = ahead / np.linalg.norm(ahead)
    x = across / np.linalg.norm(across)
    world_R_camera = np.column_stack([x, np.cross(z, x), z])
    return inverse(np.concatenate([quaternion_from_matrix(world_R_camera), place]))


def orbit_poses(
    target: ArrayLike, radius_m: float, count: int, *, arc_rad: float = 1.2, height_m: float = 0.3
) -> Array:
    """Poses (count, 7) camera_T_world on an arc about a target, all looking at it.

    Parameters
    ----------
    arc_rad : from the first to the last, half of it to each side of the way back along -z
    height_m : of the camera above the target
    """
    middle = np.array(target, dtype=np.float64)
    angles = np.linspace(-0.5, 0.5, count) * arc_rad if count > 1 else np.zeros(count)
    offsets = np.column_stack(
        [radius_m * np.sin(angles), np.full(count, -height_m), -radius_m * np.cos(angles)]
    )
    return np.array([looking_at(middle + offset, middle) for offset in offsets]).reshape(count, 7)


def sideways_poses(count: int, step_m: float) -> Array:
    """Poses (count, 7) camera_T_world to the right, the axes parallel; the first is the world."""
    return _straight(count, (step_m, 0.0, 0.0))


def forward_poses(count: int, step_m: float) -> Array:
    """Poses (count, 7) camera_T_world straight ahead, as from a vehicle; the first is the world."""
    return _straight(count, (0.0, 0.0, step_m))


def _straight(count: int, step: tuple[float, float, float]) -> Array:
    poses = np.zeros((count, 7))
    poses[:, 0] = 1.0
    poses[:, 4:] = -np.arange(count)[:, None] * np.array(step)
    return poses


def turning_poses(count: int, step_rad: float, axis: tuple[float, float, float] = (0.0, 1.0, 0.0)) -> Array:
    """Poses (count, 7) camera_T_world that only turn: no pair of them can tell a depth."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return np.array([np.append(quaternion_exp(-k * step_rad * unit), np.zeros(3)) for k in range(count)])


def render_journey(
    camera: Camera, cameras_T_world: ArrayLike, scene: Scene, *, rng: np.random.Generator, **settings: Any
) -> tuple[RenderedView, ...]:
    """Photograph a scene from each pose (V, 7), each image with noise of its own.

    Parameters
    ----------
    settings : of `render_scene`
    """
    poses = np.asarray(cameras_T_world, dtype=np.float64)
    return tuple(
        render_scene(camera, pose, scene, rng=own, **settings)
        for pose, own in zip(poses, rng.spawn(len(poses)), strict=True)
    )


def scene_points(scene: Scene, count: int, rng: np.random.Generator) -> Array:
    """Points (count, 3) of the world, spread evenly over all surfaces of a scene, m."""
    areas = np.array([_area(shape) for shape in scene.shapes])
    chosen = rng.choice(len(areas), size=count, p=areas / areas.sum())
    points = np.empty((count, 3))
    for k, shape in enumerate(scene.shapes):
        here = chosen == k
        if shape.kind == "sphere":
            normal = rng.normal(size=(int(here.sum()), 3))
            own = 0.5 * shape.size_m[0] * normal / np.linalg.norm(normal, axis=1, keepdims=True)
        else:
            own = np.zeros((int(here.sum()), 3))
            own[:, :2] = rng.uniform(-0.5, 0.5, (len(own), 2)) * np.array(shape.size_m)
        points[here] = transform(shape.world_T_shape, own)
    return points


def _area(shape: Shape) -> float:
    width, height = shape.size_m
    return np.pi * width * height if shape.kind == "sphere" else width * height


def observe(camera: Camera, cameras_T_world: ArrayLike, scene: Scene, points: ArrayLike) -> Array:
    """Exact pixels (V, P, 2) of points (P, 3) of the scene's surface from poses (V, 7); NaN where hidden."""
    own = np.asarray(points, dtype=np.float64)
    rows = []
    for pose in np.asarray(cameras_T_world, dtype=np.float64).reshape(-1, 7):
        pixels = camera.project(transform(pose, own))
        pixels[~is_seen(camera, pose, scene, own)] = np.nan
        rows.append(pixels)
    return np.array(rows).reshape(-1, len(own), 2)
