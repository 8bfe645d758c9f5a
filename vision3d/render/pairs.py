"""Two photographs of one scene, taken at once: a stereo pair, its disparity, and what one eye only sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vision3d.render.solid import RenderedView, Scene, is_seen, render_scene
from vision3d.rigid import compose, transform

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["StereoView", "render_stereo", "transfer"]

Array = NDArray[np.float64]
IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class StereoView:
    """A pair and its truth.

    Attributes
    ----------
    left, right : photographs with their own depth
    right_pixels : (h, w, 2) where what a pixel of the left image shows would appear in the right one; NaN
        where there is no surface, or it lies behind the right camera
    disparity : (h, w) x in the left image less x in the right one, px; of use where the pair is rectified
    occluded : (h, w) the right camera does not see it: hidden, or outside its image
    """

    left: RenderedView
    right: RenderedView
    right_pixels: Array
    disparity: Array
    occluded: NDArray[np.bool_]


def render_stereo(
    left: Camera,
    right: Camera,
    right_T_left: ArrayLike,
    scene: Scene,
    *,
    left_T_world: ArrayLike = IDENTITY,
    rng: np.random.Generator | None = None,
    **settings: Any,
) -> StereoView:
    """Photograph a scene with two cameras.

    Parameters
    ----------
    right_T_left : (7,) pose; a rectified pair has no rotation and (-baseline, 0, 0)
    left_T_world : (7,) pose
    rng : for the noise, each image its own; None for none
    settings : of `render_scene`
    """
    first = np.asarray(left_T_world, dtype=np.float64)
    second = compose(np.asarray(right_T_left, dtype=np.float64), first)
    own = (None, None) if rng is None else rng.spawn(2)
    a = render_scene(left, first, scene, rng=own[0], **settings)
    b = render_scene(right, second, scene, rng=own[1], **settings)
    flat = a.points.reshape(-1, 3)
    pixels = right.project(transform(second, flat)).reshape(*a.depth.shape, 2)
    seen = is_seen(right, second, scene, flat).reshape(a.depth.shape)
    columns = np.arange(left.size[0], dtype=np.float64)
    return StereoView(a, b, pixels, columns - pixels[..., 0], ~seen)


def transfer(view: RenderedView, other: RenderedView, scene: Scene, pixels: ArrayLike) -> Array:
    """Where what pixels (N, 2) of one view show appears in another, (N, 2); NaN where it is not seen there.

    It is the truth of a match between two photographs of one scene.
    """
    from vision3d.render.solid import surface_points

    points, _ = surface_points(view.camera, view.camera_T_world, scene, pixels)
    there = other.camera.project(transform(other.camera_T_world, points))
    there[~is_seen(other.camera, other.camera_T_world, scene, points)] = np.nan
    return there
