"""Photographs of textured planes by a known camera: truth for detectors, calibrations and poses.

A pixel is the mean of what the plane shows between the pixel's edges, then blurred by the lens (a Gaussian),
made darker towards the corners, made noisy, and rounded to 8 bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold import SE3
from sequential.manifold.quaternion import rotation_matrix
from vision3d.render.texture import Texture

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["BACKGROUND", "Plane", "render_planes"]

BACKGROUND = 0.35
EXPOSURE = 235.0  # grey level of reflectance 1 in the middle of the image
MOTION_SAMPLES = 9
CURVED = 4  # times the samples of a picture: an edge is a jump, a picture is smooth


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """A texture somewhere in front of the camera.

    Attributes
    ----------
    camera_T_plane : (7,) pose of the texture's frame, qw qx qy qz px py pz
    texture : what is printed on it
    motion : (6,) how the plane moves while the shutter is open, rad and m, in its own frame (rotation,
        translation): from half of it before the pose to half of it after
    """

    camera_T_plane: NDArray[np.float64]
    texture: Texture
    motion: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for name, size in (("camera_T_plane", 7), ("motion", 6)):
            if (given := getattr(self, name)) is None:
                continue
            array = np.array(given, dtype=np.float64)
            if array.shape != (size,) or not np.isfinite(array).all():
                raise ShapeError(f"{name} of a plane must be ({size},) and finite; got {given!r}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def render_planes(
    camera: Camera,
    planes: Sequence[Plane],
    *,
    rng: np.random.Generator | None = None,
    blur_px: float = 0.7,
    noise: float = 2.0,
    vignetting: float = 0.25,
    supersample: int = 4,
    background: float | ArrayLike = BACKGROUND,
    exposure: float = EXPOSURE,
) -> NDArray[np.uint8]:
    """Photograph planes; those later in the list hide those before.

    Parameters
    ----------
    camera : any lens
    rng : for the noise; None for none
    blur_px : standard deviation of the lens' Gaussian blur
    noise : grey levels; the variance is ``noise² (1/4 + reflectance)``
    vignetting : share of the light that the corners of the image lose
    supersample : a pixel of a picture is sampled at the square of this many points, one on a curved edge at
        four times as many; straight edges are exact
    background : reflectance, one or (h, w)
    exposure : grey level of reflectance 1

    Returns
    -------
    NDArray[np.uint8]
        The image (h, w).

    Raises
    ------
    ModelError, ShapeError
        where a setting has no meaning, or the background another size.
    """
    check_settings(supersample, blur_px, noise, vignetting)
    radiance = radiance_of(camera, planes, supersample=supersample, background=background)
    return developed(radiance, rng, blur_px, noise, vignetting, exposure)


def check_settings(supersample: int, blur_px: float, noise: float, vignetting: float) -> None:
    """Refuse what no lens and no sensor can do."""
    if supersample < 1 or blur_px < 0 or noise < 0 or not 0 <= vignetting <= 1:
        raise ModelError(
            "expected supersample >= 1, blur_px >= 0, noise >= 0 and vignetting 0-1; "
            f"got {supersample}, {blur_px}, {noise}, {vignetting}"
        )


def developed(
    radiance: NDArray[np.float32],
    rng: np.random.Generator | None,
    blur_px: float,
    noise: float,
    vignetting: float,
    exposure: float,
) -> NDArray[np.uint8]:
    """The image (h, w) that a lens and a sensor make of radiance (h, w)."""
    import cv2

    from vision3d.kernels.render import develop

    if blur_px > 0:
        radiance = np.asarray(cv2.GaussianBlur(radiance, (0, 0), blur_px), dtype=np.float32)
    normal = np.empty((0, 0), np.float32)
    if rng is not None and noise > 0:
        normal = rng.standard_normal(radiance.shape, dtype=np.float32)
    image = np.empty(radiance.shape, np.uint8)
    develop(radiance, normal, exposure, vignetting, noise, image)
    return image


def radiance_of(
    camera: Camera,
    planes: Sequence[Plane],
    *,
    supersample: int = 4,
    background: float | ArrayLike = BACKGROUND,
) -> NDArray[np.float32]:
    """What falls on each pixel (h, w), before lens blur, vignetting and noise."""
    width, height = camera.size
    behind = np.asarray(background, dtype=np.float32)
    if behind.shape not in ((), (height, width)):
        raise ShapeError(f"the background must be one number or ({height}, {width}); got {behind.shape}")
    empty = np.ascontiguousarray(np.broadcast_to(behind, (height, width)), dtype=np.float32)
    steps = MOTION_SAMPLES if any(plane.motion is not None for plane in planes) else 1
    total = np.zeros_like(empty)
    for moment in (np.arange(steps) + 0.5) / steps - 0.5:
        image = empty.copy()
        for plane in planes:
            _paint(image, camera, plane, float(moment), supersample)
        if steps == 1:
            return image
        total += image / np.float32(steps)
    return total


def _paint(image: NDArray[np.float32], camera: Camera, plane: Plane, moment: float, supersample: int) -> None:
    """One plane at one moment of the exposure, -0.5 to 0.5."""
    from vision3d.kernels.render import paint

    pose = plane.camera_T_plane
    if plane.motion is not None:
        pose = SE3().retract(pose, moment * plane.motion)
    rotation = rotation_matrix(pose[:4])
    # a ray d meets the plane at (x, y) where s d = x r1 + y r2 + t
    axes = np.column_stack([rotation[:, 0], rotation[:, 1], pose[4:]])
    if abs(np.linalg.det(axes)) < 1e-9 * np.linalg.norm(pose[4:]):
        return  # seen edge-on
    texture = plane.texture
    samples = supersample**2 if texture.is_picture else CURVED * supersample**2
    paint(
        image, corner_rays(camera), np.linalg.inv(axes), texture.kind,
        texture.x_edges, texture.y_edges, texture.values, texture.radii, texture.inner,
        lattice(samples),
    )  # fmt: skip


@lru_cache(maxsize=3)
def corner_rays(camera: Camera) -> NDArray[np.float64]:
    """Rays (h + 1, w + 1, 3) through the corners of the pixels, kept for the next image of this camera."""
    width, height = camera.size
    u, v = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
    return camera.unproject(np.stack([u, v], axis=-1))


@lru_cache(maxsize=16)
def lattice(count: int) -> NDArray[np.float64]:
    """Points (count, 2) of the unit square: no two share a row or a column, and none is near another.

    A rank-1 lattice; its generator is the one whose nearest points, round the edges, are farthest apart.
    """
    k = np.arange(count)
    best, widest = 1, -1.0
    for generator in range(1, count // 2 + 1):
        if np.gcd(generator, count) != 1:
            continue
        offsets = np.column_stack([k, k * generator % count])[1:]
        offsets = np.minimum(offsets, count - offsets)
        nearest = float(np.min(np.sum(offsets**2, axis=1), initial=2 * count**2))
        if nearest > widest:
            best, widest = generator, nearest
    return (np.column_stack([k, k * best % count]) + 0.5) / count
