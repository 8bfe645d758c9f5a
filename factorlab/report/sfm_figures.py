"""Figures of structure from motion: space, errors, tracks, pairs and loops."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.camera_figures import frame_axes
from factorlab.report.style import WIDTH, blank, legend_below
from sequential.manifold.quaternion import quaternion_inverse, quaternion_multiply
from vision3d.sfm import Reconstruction, ViewGraph
from vision3d.sfm.geometry import upright
from vision3d.sfm.pyramids import camera_pyramids
from vision3d.sfm.view_graph import Loops, angle_of

__all__ = ["errors", "loops", "matches", "space", "tracks"]

BLUE, RED, SOFT, GREEN = "#0072B2", "#D55E00", "#9a9a9a", "#009E73"
MOST_POINTS, MOST_NUMBERED = 20_000, 40
EDGES = ((0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1))
CELLS = 8


def space(found: Reconstruction) -> Figure | None:
    """From above, from the front, and at a slant."""
    if not len(found.points):
        return None
    turn = upright(found)
    middle = np.median(found.points, axis=0)
    points = (found.points - middle) @ turn.T
    corners = (camera_pyramids(found)[0] - middle) @ turn.T
    tips = corners[::5]
    chosen = _near(points, tips)
    points, colors = points[chosen], found.colors[chosen] / 255.0
    slant = _slanted(np.radians(35.0), np.radians(30.0))
    views: tuple[tuple[str, NDArray[Any]], ...] = (
        ("from above", np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])),
        ("from behind the cameras", np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])),
        ("at a slant", slant),
    )
    figure, axes = blank(9.0, 2, 2)
    for ax, (title, rows) in zip((axes[0, 0], axes[0, 1], axes[1, 0]), views, strict=True):
        _view(ax, points @ rows.T, colors, corners @ rows.T, tips @ rows.T)
        ax.set_title(title)
    _view(axes[1, 1], points @ slant.T, colors, corners[:0], tips[:0])
    axes[1, 1].set_title("the same slant, points only")
    return figure


def _slanted(yaw: float, pitch: float) -> NDArray[np.float64]:
    """Rows right, up and towards the reader of a view from above, turned by angles in rad."""
    right = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    forward = np.array([-np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), -np.sin(pitch)])
    return np.array([right, np.cross(right, forward), -forward])


def _near(points: NDArray[Any], tips: NDArray[Any]) -> NDArray[np.int64]:
    """Rows of points to draw: a few that are far out would shrink everything."""
    apart = np.linalg.norm(points, axis=1)
    reach = max(1.6 * float(np.quantile(apart, 0.8)), 1.2 * float(np.linalg.norm(tips, axis=1).max()), 1e-9)
    kept = np.flatnonzero(apart <= reach)
    if len(kept) > MOST_POINTS:
        kept = kept[np.linspace(0, len(kept) - 1, MOST_POINTS).astype(int)]
    return kept


def _view(
    ax: Axes, points: NDArray[Any], colors: NDArray[Any], corners: NDArray[Any], tips: NDArray[Any]
) -> None:
    """One orthographic view; what is nearer is drawn last."""
    order = np.argsort(points[:, 2])
    size = float(np.clip(6000.0 / max(len(points), 1), 1.0, 7.0))
    x, y = points[order, :2].T
    ax.scatter(x, y, s=size, c=colors[order], linewidths=0, rasterized=True)
    if len(corners):
        lines = [corners[[5 * k + a, 5 * k + b], :2] for k in range(len(tips)) for a, b in EDGES]
        ax.add_collection(LineCollection(lines, colors=RED, linewidths=0.7))
        for k, tip in enumerate(tips[:, :2] if len(tips) <= MOST_NUMBERED else ()):
            ax.annotate(str(k + 1), tip, (3, 3), textcoords="offset points", fontsize=7.5, color="#7a2c00")
    ax.set_aspect("equal", adjustable="datalim")
    ax.autoscale_view()
    ax.set_facecolor("#f4f4f4")
    ax.set(xticklabels=[], yticklabels=[])
    ax.tick_params(length=0)


def errors(found: Reconstruction) -> Figure | None:
    """Lengths of residuals, and their means over the image."""
    residuals = found.residuals()
    finite = np.asarray(np.isfinite(residuals).all(axis=1))
    if not finite.any():
        return None
    size = found.cameras[0].size
    share = 0.5
    height = min(5.5, (share * WIDTH - 0.6) * size[1] / size[0] + 1.3)
    figure, axes = blank(height, 1, 2)
    bars, field = axes[0]
    lengths = np.hypot(*residuals[finite].T)
    most = max(float(np.quantile(lengths, 0.99)) * 1.2, 4.0 * found.sigma_px)
    grid = np.linspace(0.0, most, 50)
    counted = np.clip(lengths, 0.0, most)
    bars.hist(counted, bins=grid, density=True, color="#9cc3dd", label="residuals")
    middle, sigma = 0.5 * (grid[1:] + grid[:-1]), found.rms_px / np.sqrt(2.0)
    normal = middle / sigma**2 * np.exp(-0.5 * (middle / sigma) ** 2)
    bars.plot(middle, normal, color="black", label="normal, of the same RMS")
    bars.axvline(found.rms_px, color=RED, linestyle="--", linewidth=1.0, label=f"RMS {found.rms_px:.2f} px")
    bars.set(xlabel="length of the residual, px", ylabel="density", yticks=[], xlim=(0.0, most))
    _field(field, found, residuals, finite)
    legend_below(figure, bars)
    return figure


def _field(ax: Axes, found: Reconstruction, residuals: NDArray[Any], finite: NDArray[Any]) -> None:
    """Means over cells of all pictures of the camera with most of them."""
    camera_of = found.camera_of[found.image_index]
    most = int(np.bincount(camera_of).argmax())
    mine = finite & (camera_of == most)
    size = found.cameras[most].size
    side = max(size) / CELLS
    columns = int(np.ceil(size[0] / side))
    cell = np.clip(found.pixels[mine] // side, 0, columns).astype(int) @ np.array([1, columns])
    told = residuals[mine]
    rows = []
    for one in np.unique(cell):
        inside = cell == one
        if (count := int(inside.sum())) < 8:
            continue
        mean, error = told[inside].mean(axis=0), np.sqrt(told[inside].var(axis=0).sum() / count)
        rows.append((*found.pixels[mine][inside].mean(axis=0), *mean, np.hypot(*mean) > 3.0 * error))
    if rows:
        table = np.array(rows)
        typical = float(np.median(np.hypot(table[:, 2], table[:, 3])))
        gain = 0.04 * size[0] / max(typical, 1e-6)
        for strong, colour in ((0.0, SOFT), (1.0, RED)):
            at = table[table[:, 4] == strong]
            look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.004}
            ax.quiver(*at[:, :2].T, *(gain * at[:, 2:4]).T, color=colour, **look)
        ax.set_title(f"measured − predicted, mean of cells, {gain:.0f} times enlarged; red: beyond 3σ")
    frame_axes(ax, size)


def tracks(found: Reconstruction, angles_rad: NDArray[np.float64]) -> Figure | None:
    """Lengths of tracks and triangulation angles."""
    if not len(found.points):
        return None
    figure, axes = blank(3.0, 1, 2)
    left, right = axes[0]
    lengths = found.track_lengths
    most = int(lengths.max())
    counts = np.bincount(lengths, minlength=most + 1)[2:]
    left.bar(np.arange(2, most + 1), counts, 0.8, color="#9cc3dd")
    left.set(xlabel="pictures that see a point", ylabel="points", xlim=(1.4, most + 0.6))
    left.xaxis.get_major_locator().set_params(integer=True)
    degrees = np.degrees(angles_rad)
    right.hist(degrees, bins=40, color="#9cc3dd")
    _middle(right, degrees, 1)
    right.set(xlabel="triangulation angle, °", ylabel="points")
    right.legend()
    return figure


def _middle(ax: Axes, degrees: NDArray[Any], digits: int) -> None:
    """A line at the median."""
    median = float(np.median(degrees))
    ax.axvline(median, color=RED, linestyle="--", linewidth=1.0, label=f"median {median:.{digits}f}°")


def matches(graph: ViewGraph) -> Figure | None:
    """Verified matches of every pair, and which share of all its matches they are."""
    count = len(graph.names)
    verified = graph.matrix(graph.inliers).astype(float)
    found = graph.matrix(graph.matches).astype(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(found > 0.0, 100.0 * verified / found, np.nan)
    verified[verified == 0.0] = np.nan
    figure, axes = blank(float(np.clip(0.35 * count, 2.8, 6.0)), 1, 2)
    for ax, table, label in (
        (axes[0, 0], verified, "verified matches"), (axes[0, 1], share, "share of all matches, %")
    ):  # fmt: skip
        shown = ax.imshow(table, cmap="viridis", interpolation="nearest", vmin=0.0)
        figure.colorbar(shown, ax=ax, label=label, shrink=0.9)
        _named(ax, table, graph.names if ax is axes[0, 0] else ("",) * count)
    return figure


def _named(ax: Axes, table: NDArray[Any], names: tuple[str, ...]) -> None:
    """Numbers and names along the sides, and values where there is room."""
    count = len(table)
    ticks = np.arange(0, count, -(-count // 40))
    ax.set_xticks(ticks, [str(k + 1) for k in ticks])
    ax.set_yticks(ticks, [f"{names[k][:28]}  {k + 1}" for k in ticks])
    ax.grid(visible=False)
    if count > 10:
        return
    for (row, column), value in np.ndenumerate(table):
        if np.isfinite(value):
            colour = "black" if value > 0.55 * np.nanmax(table) else "white"
            ax.text(column, row, f"{value:.0f}", ha="center", va="center", fontsize=7, color=colour)


def loops(graph: ViewGraph, found_loops: Loops, found: Reconstruction | None) -> Figure | None:
    """Errors round triangles, and of pairs against the model."""
    figure, axes = blank(3.0, 1, 2)
    left, right = axes[0]
    degrees = np.degrees(found_loops.errors_rad)
    top = max(float(degrees.max()), 1.0)
    left.hist(
        degrees, bins=np.linspace(0.0, top, int(np.clip(2.0 * np.sqrt(len(degrees)), 6, 40))), color="#9cc3dd"
    )
    left.set(xlabel="rotation round a triangle, °", ylabel="triangles")
    _middle(left, degrees, 2)
    left.legend()
    inliers, errors_deg = _against(graph, found)
    if len(inliers):
        right.plot(inliers, errors_deg, ".", color=BLUE, markersize=4)
        right.set(xlabel="verified matches of a pair", ylabel="pair against model, °")
        right.set_ylim(bottom=0.0)
        right.set_xlim(left=0.0)
    else:
        right.axis("off")
    return figure


def _against(graph: ViewGraph, found: Reconstruction | None) -> tuple[NDArray[Any], NDArray[Any]]:
    """Verified matches of pairs, and the angle between their rotation and the model's, °."""
    if found is None:
        return np.zeros(0), np.zeros(0)
    view_of = {name: k for k, name in enumerate(found.names)}
    inliers, angles = [], []
    for (a, b), count, b_R_a in zip(graph.pairs, graph.inliers, graph.b_R_a, strict=True):
        first, second = view_of.get(graph.names[a]), view_of.get(graph.names[b])
        if first is None or second is None or not np.isfinite(b_R_a).all():
            continue
        told = quaternion_multiply(
            found.cameras_T_world[second, :4], quaternion_inverse(found.cameras_T_world[first, :4])
        )
        inliers.append(count)
        angles.append(float(np.degrees(angle_of(quaternion_multiply(told, quaternion_inverse(b_R_a))))))
    return np.array(inliers), np.maximum(np.array(angles), 1e-3)
