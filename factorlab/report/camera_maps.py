"""Maps over the image: how sure a camera is of where a point falls, and how two cameras differ there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.camera_figures import frame_axes, height_of
from factorlab.report.style import blank

if TYPE_CHECKING:
    from factorlab.camera.calibrated import CalibratedCamera

Array = NDArray[np.float64]

__all__ = ["difference_map", "uncertainty_map"]


def uncertainty_map(done: CalibratedCamera) -> Figure | None:
    """Standard deviation of a projection over the image, as it is and less a turn of the whole camera."""
    size = done.calibration.camera.size
    figure, axes = blank(height_of(size), 1, 2)
    dots = np.concatenate([view.pixels for view in done.calibration.views])
    maps = (done.uncertainty, done.uncertainty_freed)
    levels = levels_of(np.concatenate([one.map_px.ravel() for one in maps]))
    titles = ("as calibrated", "less a turn of the whole camera")
    drawn = []
    for ax, one, title in zip(axes[0], maps, titles, strict=True):
        drawn.append(_map(ax, one.pixels, one.map_px, size, levels, "viridis"))
        ax.plot(*dots.T, ".", color="white", markersize=1.2, alpha=0.55)
        ax.set_title(title)
    figure.colorbar(drawn[0], ax=list(axes[0]), shrink=0.8, label="σ of a projection, px", format=plain)
    return figure


def difference_map(done: CalibratedCamera) -> Figure | None:
    """By how many pixels two calibrations disagree about the same ray, and in which direction."""
    if (found := done.difference) is None:
        return None
    size = done.calibration.camera.size
    figure, axes = blank(height_of(size), 1, 2)
    left, right = axes[0]
    shown = _map(left, found.pixels, found.map_px, size, levels_of(found.map_px), "magma")
    left.set_title("distance, px")
    figure.colorbar(shown, ax=left, shrink=0.8, format=plain)
    columns, rows = found.grid
    vectors = found.vectors.reshape(rows, columns, 2)[::2, ::2]
    at = found.pixels.reshape(rows, columns, 2)[::2, ::2]
    gain = 0.06 * size[0] / max(float(np.nanpercentile(found.distance_px, 90)), 1e-9)
    look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.0025}
    right.quiver(*np.moveaxis(at, -1, 0), *(gain * np.moveaxis(vectors, -1, 0)), color="#0072B2", **look)
    frame_axes(right, size)
    right.set_title(f"direction, {gain:.3g} times enlarged")
    return figure


def _map(ax: Axes, pixels: Array, values: Array, size: tuple[int, int], levels: Array, colours: str) -> Any:
    """Colours and lines of equal value over a grid: pixels (X*Y, 2) row by row, values (Y, X)."""
    columns = values.shape[1]
    x, y = pixels[:columns, 0], pixels[::columns, 1]
    masked = np.ma.masked_invalid(values)
    look: dict[str, Any] = {"levels": levels, "norm": BoundaryNorm(levels, 256)}
    shown = ax.contourf(x, y, np.ma.clip(masked, levels[0], levels[-1]), cmap=colours, **look)
    lines = ax.contour(x, y, masked, levels=levels[1:-1], colors="white", linewidths=0.6)
    ax.clabel(lines, fmt=plain, fontsize=7)
    frame_axes(ax, size)
    return shown


def plain(value: float, _: Any = None) -> str:
    """A number as a label has it."""
    return f"{value:.3g}"


def levels_of(values: Array) -> Array:
    """Levels 1, 2, 5, 10 … that span the values, closer ones where they hardly differ; at least four."""
    finite = values[np.isfinite(values) & (values > 0.0)]
    low, high = (float(finite.min()), float(np.percentile(finite, 99.5))) if len(finite) else (0.1, 1.0)
    for steps in ((1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)):
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        series = np.unique(np.outer(decades, steps).round(12))
        first = max(0, int(np.searchsorted(series, low, side="right")) - 1)
        last = min(len(series) - 1, int(np.searchsorted(series, high)))
        if last - first >= 4:
            return np.asarray(series[first : last + 1])
    return np.linspace(low, max(high, 1.001 * low), 7)
