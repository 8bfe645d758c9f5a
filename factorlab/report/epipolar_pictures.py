"""Two pictures with epipolar curves: a few matches, and where the motion says each must lie in the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.camera_figures import frame_axes
from factorlab.report.style import WIDTH, blank

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.two_view import TwoView

__all__ = ["epipolar_curves", "spread_choice"]

COLOURS = ("#E69F00", "#56B4E9", "#009E73", "#F0E442", "#D55E00", "#CC79A7", "#ffffff", "#8fd14f")
EPIPOLE = "#ff3b30"

Array = NDArray[np.float64]


def epipolar_curves(
    images: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    cameras: tuple[Camera, Camera],
    pixels: tuple[Array, Array],
    view: TwoView,
    *,
    count: int = 8,
) -> Figure | None:
    """Pictures a and b (h, w) grey, `count` matches that agree, and the curve of each in the other picture.

    None where the motion has no translation, or nothing agrees.
    """
    from vision3d.rigid import inverse

    if not view.known or not view.b_T_a[4:].any() or not view.inliers.any():
        return None
    chosen = spread_choice(pixels[0], view.inliers, count)
    tall = max(camera.size[1] / camera.size[0] for camera in cameras)
    figure, axes = blank(0.5 * WIDTH * tall + 0.5, 1, 2)
    from_b, to_b = inverse(view.b_T_a), view.b_T_a
    for side, (ax, motion) in enumerate(zip(axes[0], (from_b, to_b), strict=True)):
        own, other = cameras[side], cameras[1 - side]
        _picture(ax, images[side], own)
        _curves(ax, own, other, motion, pixels[1 - side][chosen])
        _matches(ax, pixels[side][chosen])
        _epipole(ax, own, motion[4:])
        ax.set_title(f"picture {'ab'[side]}: matches, and the curves of their partners")
    return figure


def spread_choice(pixels: Array, inliers: NDArray[np.bool_], count: int) -> NDArray[np.int64]:
    """Rows of a few inliers far from each other: each the farthest from those before it."""
    rows = np.flatnonzero(inliers)
    places = pixels[rows]
    taken = [int(np.argmin(np.sum((places - np.median(places, axis=0)) ** 2, axis=1)))]
    away = np.full(len(rows), np.inf)
    while len(taken) < min(count, len(rows)):
        away = np.minimum(away, np.sum((places - places[taken[-1]]) ** 2, axis=1))
        taken.append(int(np.argmax(away)))
    return np.asarray(rows[taken], dtype=np.int64)


def _picture(ax: Axes, image: NDArray[np.uint8], camera: Camera) -> None:
    frame_axes(ax, camera.size)
    ax.imshow(image, cmap="gray", vmin=0, vmax=255, alpha=0.75, interpolation="antialiased")


def _curves(ax: Axes, own: Camera, other: Camera, own_T_other: Array, partners: Array) -> None:
    from vision3d.two_view import epipolar_curve

    for k, pixel in enumerate(partners):
        curve = epipolar_curve(other, own, own_T_other, pixel, count=400)
        if len(curve) > 1:
            ax.plot(*curve.T, color=COLOURS[k % len(COLOURS)], linewidth=1.1)


def _matches(ax: Axes, pixels: Array) -> None:
    for k, pixel in enumerate(pixels):
        colour = COLOURS[k % len(COLOURS)]
        ax.plot(*pixel, "o", color=colour, markersize=5, markeredgecolor="black", markeredgewidth=0.7)


def _epipole(ax: Axes, camera: Camera, direction: Array) -> None:
    """Where the other camera stands, if this one sees it, ahead or behind."""
    for sign in (1.0, -1.0):
        (pixel,) = camera.project(sign * direction[None])
        if np.isfinite(pixel).all() and (pixel >= 0.0).all() and (pixel < camera.size).all():
            ax.plot(*pixel, "x", color=EPIPOLE, markersize=10, markeredgewidth=2.0)
