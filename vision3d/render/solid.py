"""Photographs of rectangles and spheres in space, with what is true of every pixel.

    scene = desk(rng)
    view = render_scene(camera, camera_T_world, scene, rng=rng)
    view.image, view.depth, view.shape_id

The world is the frame of the first camera, as a rule: x right, y down, z forward, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.render.scene import (
    BACKGROUND,
    EXPOSURE,
    check_settings,
    corner_rays,
    developed,
    lattice,
)
from vision3d.render.shapes import Shape
from vision3d.rigid import inverse, transform

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["RenderedView", "Scene", "cast_rays", "is_seen", "render_scene", "surface_points"]

Array = NDArray[np.float64]
SURFACE = 1e-7
"""How near, as a share of the distance, a point lies to its own surface."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Shapes that stand still, and the light on them.

    Parameters
    ----------
    shapes : the surfaces; what is nearer hides what is behind
    light : (3,) direction in which the light travels, in the world
    ambient : share of the light that comes from everywhere; the rest depends on the surface's direction
    background : reflectance where there is no surface
    name : what it is a scene of
    """

    shapes: tuple[Shape, ...]
    light: tuple[float, float, float] = (0.3, 0.8, 0.5)
    ambient: float = 0.55
    background: float = BACKGROUND
    name: str = ""

    def __post_init__(self) -> None:
        if not self.shapes:
            raise ModelError("a scene has one shape at least, got none")
        if not np.linalg.norm(self.light) > 0 or not 0 <= self.ambient <= 1:
            raise ModelError(
                f"expected a direction of light and ambient 0-1; got {self.light}, {self.ambient}"
            )

    @cached_property
    def table(self) -> Array:
        """(P, 20) what the compiled renderer reads of the shapes."""
        from vision3d.kernels.scenes import COLUMNS, RECTANGLE, SPHERE

        codes = {"rectangle": RECTANGLE, "sphere": SPHERE}
        rows = np.empty((len(self.shapes), COLUMNS))
        for row, shape in zip(rows, self.shapes, strict=True):
            row[0] = codes[shape.kind]
            row[1:10] = rotation_matrix(shape.world_T_shape[:4]).T.ravel()
            row[10:13] = shape.world_T_shape[4:]
            row[13:15] = 0.5 * np.array(shape.size_m)
            row[15:19] = shape.window
            row[19] = self._materials.index(id(shape.material))
        return rows

    @cached_property
    def _materials(self) -> list[int]:
        return list(dict.fromkeys(id(shape.material) for shape in self.shapes))

    @cached_property
    def pyramids(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Where each level (M, L, 3) of each material begins in one long row of texels."""
        own = {id(shape.material): shape.material.levels for shape in self.shapes}
        levels = np.zeros((len(own), max(len(each) for each in own.values()), 3), np.int64)
        texels, start = [], 0
        for m, name in enumerate(self._materials):
            for k, picture in enumerate(own[name]):
                levels[m, k] = start, picture.shape[1], picture.shape[0]
                texels.append(picture.ravel())
                start += picture.size
        return levels, np.concatenate(texels)


@dataclass(frozen=True, slots=True, eq=False)
class RenderedView:
    """A photograph of a scene and its truth.

    Attributes
    ----------
    image : (h, w) uint8, or (h, w, 3) BGR
    depth : (h, w) m along the optical axis at the centre of each pixel; NaN where there is no surface
    shape_id : (h, w) index into the scene's shapes, -1 where there is none
    points : (h, w, 3) m in the world, what the centre of each pixel shows
    camera, camera_T_world : what took it, and from where
    """

    image: NDArray[np.uint8]
    depth: Array
    shape_id: NDArray[np.int64]
    points: Array
    camera: Camera
    camera_T_world: Array


def render_scene(
    camera: Camera,
    camera_T_world: ArrayLike,
    scene: Scene,
    *,
    rng: np.random.Generator | None = None,
    blur_px: float = 0.7,
    noise: float = 2.0,
    vignetting: float = 0.15,
    supersample: int = 4,
    exposure: float = EXPOSURE,
    colour: bool = False,
) -> RenderedView:
    """Photograph a scene.

    Parameters
    ----------
    camera : any lens
    camera_T_world : (7,) pose
    rng : for the noise; None for none
    blur_px, noise, vignetting, exposure : as in `render_planes`
    supersample : a pixel is sampled at the square of this many points
    colour : give BGR, each shape in its tint

    Raises
    ------
    ModelError, ShapeError
        where a setting has no meaning, or the pose is not seven numbers.
    """
    check_settings(supersample, blur_px, noise, vignetting)
    pose = _pose(camera_T_world)
    radiance = _radiance(camera, pose, scene, supersample, colour=colour)
    channels = [
        developed(np.ascontiguousarray(plane), rng, blur_px, noise, vignetting, exposure)
        for plane in np.moveaxis(radiance, 2, 0)
    ]
    image = np.stack(channels, axis=2) if colour else channels[0]
    return RenderedView(image, *_truth(camera, pose, scene), camera, pose)


def _radiance(
    camera: Camera, pose: Array, scene: Scene, supersample: int, *, colour: bool
) -> NDArray[np.float32]:
    """What falls on each pixel (h, w, C)."""
    from vision3d.kernels.scenes import photograph

    world_T_camera = inverse(pose)
    rays = np.ascontiguousarray(corner_rays(camera) @ rotation_matrix(world_T_camera[:4]).T)
    tints = np.array([shape.tint for shape in scene.shapes]) if colour else np.ones((len(scene.shapes), 1))
    image = np.empty((camera.size[1], camera.size[0], tints.shape[1]), np.float32)
    light = np.array(scene.light) / np.linalg.norm(scene.light)
    photograph(
        scene.table, *scene.pyramids, tints, world_T_camera[4:].copy(), rays, lattice(supersample**2),
        light, scene.ambient, scene.background, image,
    )  # fmt: skip
    return image


def _truth(camera: Camera, pose: Array, scene: Scene) -> tuple[Array, NDArray[np.int64], Array]:
    """Depth (h, w), shape (h, w) and point of the world (h, w, 3) at the centre of each pixel."""
    width, height = camera.size
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    points, found = surface_points(camera, pose, scene, np.stack([u, v], axis=-1).reshape(-1, 2))
    depth = transform(pose, points)[:, 2].reshape(height, width)
    return depth, found.reshape(height, width), points.reshape(height, width, 3)


def surface_points(
    camera: Camera, camera_T_world: ArrayLike, scene: Scene, pixels: ArrayLike
) -> tuple[Array, NDArray[np.int64]]:
    """What pixels (N, 2) show: points of the world (N, 3), NaN where nothing is, and their shapes (N,)."""
    world_T_camera = inverse(_pose(camera_T_world))
    rays = camera.unproject(np.asarray(pixels, dtype=np.float64)) @ rotation_matrix(world_T_camera[:4]).T
    distance, found = cast_rays(scene, world_T_camera[4:], rays)
    return world_T_camera[4:] + distance[:, None] * rays, found


def cast_rays(scene: Scene, origin: ArrayLike, rays: ArrayLike) -> tuple[Array, NDArray[np.int64]]:
    """Distance (N,), in lengths of each ray (N, 3) of the world from one origin (3,), and the shape it meets.

    Where it meets none the distance is NaN and the shape -1.
    """
    from vision3d.kernels.scenes import cast

    own = np.ascontiguousarray(rays, dtype=np.float64)
    distance, found = np.empty(len(own)), np.empty(len(own), np.int64)
    cast(scene.table, np.array(origin, dtype=np.float64), own, distance, found)
    return distance, found


def is_seen(camera: Camera, camera_T_world: ArrayLike, scene: Scene, points: ArrayLike) -> NDArray[np.bool_]:
    """Whether points (N, 3) of the scene's surface appear in the image, with nothing before them."""
    from vision3d.kernels.scenes import reaches

    pose = _pose(camera_T_world)
    own = np.ascontiguousarray(points, dtype=np.float64)
    clear = np.empty(len(own), np.bool_)
    reaches(scene.table, inverse(pose)[4:].copy(), own, SURFACE, clear)
    pixels = camera.project(transform(pose, own))
    size = np.array(camera.size)
    with np.errstate(invalid="ignore"):
        inside = ((pixels > -0.5) & (pixels < size - 0.5)).all(axis=1)
    seen: NDArray[np.bool_] = clear & inside
    return seen


def _pose(camera_T_world: ArrayLike) -> Array:
    pose = np.array(camera_T_world, dtype=np.float64)
    if pose.shape != (7,) or not np.isfinite(pose).all():
        raise ShapeError(
            f"camera_T_world must be seven finite numbers, qw qx qy qz px py pz; got {camera_T_world!r}"
        )
    return pose
