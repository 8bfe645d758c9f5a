"""Figures of two matched pictures: lines between them, errors, and how sure carried points are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from factorlab.report.camera_figures import frame_axes, height_of
from factorlab.report.epipolar_pictures import COLOURS, spread_choice
from factorlab.report.style import WIDTH, blank

if TYPE_CHECKING:
    from factorlab.match.fitting import Geometry
    from factorlab.match.job import Matched

__all__ = ["epipolar_lines", "errors", "lines"]

AGREE, APART = "#009E73", "#D55E00"
ENLARGED = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


def lines(picture: NDArray[np.uint8]) -> Figure:
    """The two pictures (h, w, 3) BGR with lines, at the width of the page."""
    tall = picture.shape[0] / picture.shape[1]
    figure, axes = blank(min(8.0, WIDTH * tall))
    axes[0, 0].imshow(picture[..., ::-1], interpolation="antialiased")
    axes[0, 0].axis("off")
    return figure


def errors(done: Matched, geometry: Geometry) -> Figure | None:
    """Errors of the matches that agree, and over the second picture what a homography leaves of them."""
    at = geometry.inliers
    if at.sum() < 2:
        return None
    figure, axes = blank(max(3.0, height_of(done.b.size)), 1, 2)
    _histogram(axes[0, 0], geometry.errors_px[at])
    if geometry.kind == "homography":
        _field(axes[0, 1], done, geometry)
    else:
        _coverage(axes[0, 1], done, at)
    return figure


def epipolar_lines(done: Matched, geometry: Geometry) -> Figure | None:
    """A few matches in both pictures, and the line that each lies on in the other."""
    if not geometry.inliers.any():
        return None
    rows = spread_choice(done.pixels_a, geometry.inliers, len(COLOURS))
    figure, axes = blank(max(3.0, height_of(done.b.size)), 1, 2)
    sides = (
        (axes[0, 0], done.a, done.pixels_a[rows], done.pixels_b[rows], geometry.matrix.T),
        (axes[0, 1], done.b, done.pixels_b[rows], done.pixels_a[rows], geometry.matrix),
    )
    for ax, picture, own, other, matrix in sides:
        frame_axes(ax, picture.size)
        ax.imshow(picture.image, cmap="gray", vmin=0, vmax=255, alpha=0.75, interpolation="antialiased")
        lines_of = np.column_stack([other, np.ones(len(other))]) @ matrix.T
        for (x, y), (a, b, c), colour in zip(own, lines_of, COLOURS, strict=False):
            foot = np.array([-c * a, -c * b]) / (a * a + b * b)
            along = foot + np.array([b, -a]) / np.hypot(a, b)
            ax.axline(foot.tolist(), along.tolist(), color=colour, linewidth=1.1)
            ax.plot(x, y, "o", color=colour, markersize=5, markeredgecolor="black", markeredgewidth=0.7)
        ax.set_title(picture.name)
    return figure


def _histogram(ax: Axes, values: NDArray[np.float64]) -> None:
    top = float(np.quantile(values, 0.99)) * 1.2
    ax.hist(values, bins=np.linspace(0.0, max(top, 1e-3), 40).tolist(), color=AGREE)
    median = float(np.median(values))
    ax.axvline(median, color="black", linewidth=0.9)
    ax.annotate(
        f"median {median:.2g} px", (median, 0.94), xycoords=("data", "axes fraction"), xytext=(5, 0),
        textcoords="offset points", fontsize=8.5,
    )  # fmt: skip
    ax.set(xlabel="error of a match that agrees, px", ylabel="matches")


def _field(ax: Axes, done: Matched, geometry: Geometry) -> None:
    """Errors as arrows over the second picture, and the 2σ ellipses of the first's corners."""
    from factorlab.match.precision import corner_places
    from vision3d.robust import transfer

    at = geometry.inliers
    seen = done.pixels_b[at]
    error = seen - transfer(geometry.matrix, done.pixels_a[at])
    gain = _enlargement(0.02 * done.b.size[0] / max(float(np.median(np.hypot(*error.T))), 1e-6))
    places, covs = corner_places(done, geometry)
    frame_axes(ax, done.b.size)
    ax.imshow(done.b.image, cmap="gray", alpha=0.35, vmin=0, vmax=255)
    ax.quiver(*seen.T, *(gain * error).T, angles="xy", scale_units="xy", scale=1.0, color=AGREE, width=0.0022)
    if np.isfinite(places).all() and np.abs(places).max() < 1e5:
        ax.plot(*np.vstack([places, places[:1]]).T, color=APART, linewidth=1.2)
        for place, cov in zip(places, covs, strict=True):
            _ellipse(ax, place, 4.0 * gain**2 * cov)
    ax.set_title(f"errors, and 2σ of the corners, {gain} times enlarged")


def _ellipse(ax: Axes, centre: NDArray[np.float64], cov: NDArray[np.float64]) -> None:
    lengths, axes = np.linalg.eigh(cov)
    angle = float(np.degrees(np.arctan2(axes[1, 1], axes[0, 1])))
    wide, high = 2.0 * np.sqrt(np.maximum(lengths[::-1], 0.0))
    x, y = centre
    ax.add_patch(Ellipse((float(x), float(y)), wide, high, angle=angle, fill=False, edgecolor=APART))


def _enlargement(wanted: float) -> int:
    """The nearest round number below."""
    return max((one for one in ENLARGED if one <= wanted), default=1)


def _coverage(ax: Axes, done: Matched, at: NDArray[np.bool_]) -> None:
    frame_axes(ax, done.b.size)
    ax.imshow(done.b.image, cmap="gray", alpha=0.5, vmin=0, vmax=255)
    ax.plot(*done.pixels_b[~at].T, ".", color=APART, markersize=3, alpha=0.5)
    ax.plot(*done.pixels_b[at].T, ".", color=AGREE, markersize=3)
    ax.set_title(f"where matches are in {done.b.name}")
