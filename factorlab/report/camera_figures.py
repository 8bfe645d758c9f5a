"""Figures of a camera's calibration: residuals, views, where corners fell and how the board lay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import WIDTH, blank, legend_below
from sequential.manifold.quaternion import rotation_matrix

if TYPE_CHECKING:
    from factorlab.camera.calibrated import CalibratedCamera

__all__ = ["coverage", "frame_axes", "height_of", "residual_field", "residual_scatter", "view_errors"]

FITTED, LEFT_OUT, SOFT, NEXT = "#0072B2", "#D55E00", "#9a9a9a", "#009E73"
CELLS = 10  # along the image's longer side


def frame_axes(ax: Axes, size: tuple[int, int]) -> None:
    """Axes in pixels with y down, as the image has them."""
    width, height = size
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x, px", ylabel="y, px")
    ax.set_aspect("equal")
    ax.grid(visible=False)
    for side in ("top", "right"):
        ax.spines[side].set_visible(True)


def height_of(size: tuple[int, int], share: float = 0.5) -> float:
    """Inches of a figure in which an image of this size takes a share of the page's width."""
    return min(7.0, (share * WIDTH - 0.6) * size[1] / size[0] + 1.15)


def residual_field(done: CalibratedCamera) -> Figure | None:
    """Every residual as an arrow, and what of them is the same wherever the board was."""
    size = done.calibration.camera.size
    pixels, residuals, used = _gathered(done)
    if not used.any():
        return None
    figure, axes = blank(height_of(size), 1, 2)
    left, right = axes[0]
    rms = float(np.sqrt((residuals[used] ** 2).sum(axis=1).mean()))
    gain = 0.03 * size[0] / max(rms, 1e-6)
    _arrows(left, pixels[used], residuals[used], gain, FITTED)
    if (~used).any():
        _arrows(left, pixels[~used], residuals[~used], gain, LEFT_OUT)
    left.set_title(f"measured − predicted, {gain:.0f} times enlarged")
    centres, means, errors = _cells(pixels[used], residuals[used], size)
    strong = np.hypot(*means.T) > 3.0 * errors
    gain_means = 0.03 * size[0] / max(rms / 2, 1e-6)
    for chosen, colour, label in (
        (~strong, SOFT, "within the scatter"),
        (strong, LEFT_OUT, "beyond 3σ: the lens model does not follow"),
    ):
        if chosen.any():
            _arrows(right, centres[chosen], means[chosen], gain_means, colour, 0.004)
            right.plot([], [], color=colour, linewidth=2, label=label)
    right.set_title(f"means of cells, {gain_means:.0f} times enlarged")
    for ax in (left, right):
        frame_axes(ax, size)
    legend_below(figure, right)
    return figure


def _gathered(done: CalibratedCamera) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Pixels (N, 2), residuals (N, 2) and whether each counted (N,), all views one after the other."""
    fit = done.calibration
    pixels = np.concatenate([view.pixels for view in fit.views])
    residuals = np.concatenate(fit.residuals)
    return pixels, residuals, np.concatenate(done.used)


def _arrows(
    ax: Axes, at: NDArray[Any], what: NDArray[Any], gain: float, colour: str, width: float = 0.002
) -> None:
    look: dict[str, Any] = {
        "angles": "xy",
        "scale_units": "xy",
        "scale": 1.0,
        "width": width,
        "color": colour,
    }
    ax.quiver(at[:, 0], at[:, 1], gain * what[:, 0], gain * what[:, 1], **look)


def _cells(
    pixels: NDArray[Any], residuals: NDArray[Any], size: tuple[int, int]
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Centres (K, 2), mean residuals (K, 2) and their standard errors (K,) of cells with 4 corners."""
    side = max(size) / CELLS
    columns = int(np.ceil(size[0] / side))
    cell = (pixels // side).astype(int) @ np.array([1, columns])
    centres, means, errors = [], [], []
    for one in np.unique(cell):
        inside = cell == one
        if (count := int(inside.sum())) < 4:
            continue
        centres.append(pixels[inside].mean(axis=0))
        means.append(residuals[inside].mean(axis=0))
        errors.append(np.sqrt(residuals[inside].var(axis=0, ddof=1).sum() / count))
    if not centres:
        return np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0)
    return np.array(centres), np.array(means), np.array(errors)


def residual_scatter(done: CalibratedCamera) -> Figure | None:
    """Residuals in units of their σ: a cloud about the origin, and their distribution."""
    figure, axes = blank(3.4, 1, 2, gridspec_kw={"width_ratios": (1, 1.5)})
    cloud, bars = axes[0]
    _, residuals, used = _gathered(done)
    sigma = np.concatenate(done.sigmas)[:, None]
    z = residuals / sigma
    cloud.plot(*z[used].T, ".", color=FITTED, markersize=2.5, label="used")
    if (~used).any():
        shown = np.clip(z[~used], -5.5, 5.5)
        cloud.plot(*shown.T, "x", color=LEFT_OUT, markersize=5, label="left out")
    angle = np.linspace(0.0, 2 * np.pi, 120)
    for radius in (1, 2, 3):
        cloud.plot(radius * np.cos(angle), radius * np.sin(angle), color=SOFT, linewidth=0.6)
    cloud.set(xlim=(-6, 6), ylim=(6, -6), xlabel="x residual / σ", ylabel="y residual / σ")
    cloud.set_aspect("equal")
    grid = np.linspace(-6, 6, 61)
    bars.hist(np.clip(z[used].ravel(), -6, 6), bins=grid, density=True, color="#9cc3dd", label="residual / σ")
    bars.plot(grid, np.exp(-0.5 * grid**2) / np.sqrt(2 * np.pi), color="black", label="normal")
    bars.set(xlabel="residual / σ", ylabel="density", yticks=[])
    legend_below(figure, bars)
    return figure


def view_errors(done: CalibratedCamera) -> Figure | None:
    """RMS of every view, and of the same view predicted from the others."""
    fit = done.calibration
    names = [view.name for view in fit.views]
    count = len(names)
    figure, axes = blank(3.2)
    ax = axes[0, 0]
    k = np.arange(count)
    colours = [LEFT_OUT if view in fit.outlier_views else FITTED for view in range(count)]
    ax.bar(k, fit.view_rms, 0.7, color=colours, alpha=0.75)
    ax.bar([], [], color=FITTED, alpha=0.75, label="fitted")
    if done.cross is not None:
        ax.plot(k, done.cross.view_rms, "D", color="black", markersize=4, label="predicted from the others")
    ax.axhline(fit.rms_px, color="black", linestyle="--", linewidth=0.8, label=f"all, {fit.rms_px:.3f} px")
    step = -(-count // 26)
    ax.set_xticks(
        k[::step], names[::step], rotation=0 if count <= 8 else 40, ha="center" if count <= 8 else "right"
    )
    ax.set(ylabel="RMS, px", xlim=(-0.6, count - 0.4))
    ax.grid(visible=False, axis="x")
    legend_below(figure, ax)
    return figure


def coverage(done: CalibratedCamera) -> Figure | None:
    """Where corners fell in the image, and from where the board was seen."""
    fit = done.calibration
    figure, axes = blank(height_of(fit.camera.size), 1, 2, gridspec_kw={"width_ratios": (1.3, 1)})
    left, right = axes[0]
    for view in fit.views:
        left.plot(*view.pixels.T, ".", color=FITTED, markersize=2.2)
        left.fill(*_hull(view.pixels).T, facecolor=FITTED, edgecolor=FITTED, alpha=0.06, linewidth=0.6)
    if (following := done.following) is not None:
        left.fill(*following.outline_px.T, fill=False, edgecolor=NEXT, linewidth=1.8, linestyle="--")
    frame_axes(left, fit.camera.size)
    left.set_title("corners of all views")
    _tilts(right, done)
    legend_below(figure, right)
    return figure


def _tilts(ax: Axes, done: CalibratedCamera) -> None:
    """Normals of the board as the camera sees them: direction and angle; a larger dot is nearer."""
    normals, distances = done.normals, done.distances
    ax.set_aspect("equal")
    ax.axis("off")
    angle = np.linspace(0, 2 * np.pi, 180)
    for degrees in (15, 30, 45, 60):
        radius = np.sin(np.radians(degrees))
        ax.plot(radius * np.cos(angle), radius * np.sin(angle), color="#cccccc", linewidth=0.7)
        ax.text(0, -radius, f"{degrees}°", ha="center", va="bottom", color="#777777", fontsize=8)
    area = 30.0 * (np.median(distances) / distances) ** 2 + 8.0
    ax.scatter(
        normals[:, 0], normals[:, 1], s=area, color=FITTED, alpha=0.75, label="a view, larger is nearer"
    )
    if done.following is not None:
        normal = rotation_matrix(done.following.camera_T_board[:4])[:, 2]
        look: dict[str, Any] = {"color": NEXT, "markersize": 10, "markeredgewidth": 2.2}
        ax.plot(*normal[:2], "x", linestyle="none", label="the next, as advised", **look)
    ax.set(xlim=(-0.95, 0.95), ylim=(0.95, -0.95))
    ax.set_title("tilt of the board", loc="center")


def _hull(points: NDArray[Any]) -> NDArray[Any]:
    """Corners of the convex hull, in order."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points
