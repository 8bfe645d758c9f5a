"""Figures of a stereo pair: rows, disparity, masks, depth, the cloud, the ground, and errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import blank

if TYPE_CHECKING:
    from factorlab.stereo.depth_job import DepthRun

__all__ = ["cloud", "depth", "disparity", "ground", "mask", "pair", "truth"]

LARGEST = 700  # px of a picture on the page
NEAR_FAR = "cividis"
MATCHED, HIDDEN, DOUBTFUL = (0, 158, 115), (0, 114, 178), (213, 94, 0)  # Okabe and Ito's
ON_GROUND, OFF_GROUND = "#D55E00", "#5b6b7b"
DOTS = 6000


def pair(run: DepthRun) -> Figure:
    """Both rectified pictures with rows ruled over them."""
    figure, axes = _two(run)
    height, width = run.left.shape[:2]
    upright = run.geometry is not None and run.geometry.vertical
    for ax, image, name in zip(axes, (run.left, run.right), ("left", "right"), strict=True):
        _show(ax, image[..., ::-1], f"{name}: {getattr(run.pair, f'{name}_name')}")
        for at in np.linspace(0, (width if upright else height) - 1, 12)[1:-1]:
            (ax.axvline if upright else ax.axhline)(at, color="#56B4E9", linewidth=0.6)
    return figure


def disparity(run: DepthRun) -> Figure:
    """The map and its standard deviation."""
    figure, axes = _two(run, extra=0.5)
    found = run.disparity
    low, high = np.percentile(found.map_px[found.valid], [0.5, 99.5])
    # what was filled in is paler
    image = _paint(found.map_px, low, high)
    pale = ~found.valid
    image[pale] = 0.55 * image[pale] + 0.45
    _show(axes[0], image, "")
    _bar(figure, axes[0], NEAR_FAR, low, high, "disparity (px)")
    shown = axes[1].imshow(
        _thin(np.where(found.valid, found.std_px, np.nan)), extent=_extent(run), cmap="magma_r",
        norm=LogNorm(0.03, 1.0),
    )  # fmt: skip
    axes[1].set_facecolor("#e6e6e6")
    axes[1].set(xticks=[], yticks=[])
    axes[1].grid(visible=False)
    ticks = [0.03, 0.1, 0.3, 1.0]
    bar = figure.colorbar(shown, ax=axes[1], location="bottom", shrink=0.6, aspect=35, pad=0.02, ticks=ticks)
    bar.set_ticklabels([f"{tick:g}" for tick in ticks])
    bar.ax.minorticks_off()
    bar.set_label("standard deviation (px)")
    return figure


def mask(run: DepthRun) -> Figure:
    """What was matched, what one camera alone sees, and the confidence."""
    figure, axes = _two(run, extra=0.5)
    found = run.disparity
    grey = run.left.mean(axis=2)[..., None] / 255.0
    tint = np.empty((*found.valid.shape, 3))
    tint[:] = np.array(DOUBTFUL) / 255.0
    tint[found.occluded] = np.array(HIDDEN) / 255.0
    tint[found.valid] = np.array(MATCHED) / 255.0
    _show(axes[0], 0.5 * grey + 0.5 * tint, "")
    if np.isfinite(found.confidence).any():
        _show(axes[1], _paint(found.confidence, 0.0, 0.5, "viridis"), "")
        _bar(figure, axes[1], "viridis", 0.0, 0.5, "confidence")
    else:
        axes[1].axis("off")
        axes[1].set_title("this matcher tells no confidence", loc="center")
    return figure


def depth(run: DepthRun) -> Figure | None:
    """Depth, and how its standard deviation grows with it."""
    given = run.depth
    if given is None:
        return None
    figure, axes = _two(run, extra=0.8)
    z = given.z_m[given.measured]
    low, high = np.percentile(z, [1, 98])
    _show(axes[0], _paint(given.z_m, low, high, f"{NEAR_FAR}_r"), "")
    _bar(figure, axes[0], f"{NEAR_FAR}_r", low, high, "depth (m)")
    some = np.random.default_rng(0).choice(len(z), min(DOTS, len(z)), replace=False)
    axes[1].set_box_aspect(run.left.shape[0] / run.left.shape[1])
    axes[1].plot(
        z[some], 1e3 * given.std_m[given.measured][some], ".", color="#0072B2", markersize=1.2, alpha=0.5,
        rasterized=True, label="of the match",
    )  # fmt: skip
    if given.systematic_m is not None:
        axes[1].plot(
            z[some], 1e3 * given.systematic_m[given.measured][some], ".", color=ON_GROUND, markersize=1.2,
            rasterized=True, label="of the calibration",
        )  # fmt: skip
        axes[1].legend(markerscale=8, loc="upper left")
    top = float(np.percentile(given.total_std_m[given.measured], 98)) * 1.3e3
    axes[1].set(
        xlabel="depth (m)", ylabel="standard deviation (mm)", ylim=(0, top), xlim=(0.95 * low, 1.05 * high)
    )
    return figure


def cloud(run: DepthRun) -> Figure | None:
    """The points from beside the camera and from above."""
    from vision3d.cloud import splat, viewpoint

    if run.cloud is None:
        return None
    points = run.cloud.points
    keep = points[:, 2] <= np.percentile(points[:, 2], 99)
    colors = None if run.cloud.colors is None else run.cloud.colors[keep]
    down = np.array([0.0, 1.0, 0.0]) if run.ground is None else -run.ground.normal
    figure, axes = blank(4.2, 1, 2)
    for ax, forward, title in (
        (axes[0, 0], np.array([0.45, 0.0, 1.0]) + 0.35 * down, "from the left"),
        (axes[0, 1], np.array([0.0, 0.0, 0.35]) + down, "from above"),
    ):
        camera, camera_T_world = viewpoint(
            points[keep], size=(900, 640), forward=forward, down=down if title != "from above" else (0, 0, -1)
        )
        _show(ax, splat(points[keep], colors, camera, camera_T_world, radius_px=1.5), title)
    return figure


def ground(run: DepthRun) -> Figure | None:
    """Heights above the ground, and the scene from the side."""
    from vision3d.stereo import back_project

    if run.ground is None or run.depth is None or run.geometry is None or run.cloud is None:
        return None
    figure, axes = _two(run, extra=0.8)
    points = back_project(run.depth, run.geometry.camera)
    heights = np.where(run.depth.measured, run.ground.height_of(np.nan_to_num(points)), np.nan)
    top = float(np.nanpercentile(heights, 98))
    low = min(-0.02 * top, float(np.nanpercentile(heights, 0.5)))
    _show(axes[0], _paint(heights, low, top, "viridis"), "")
    _bar(figure, axes[0], "viridis", low, top, "height above the ground (m)")
    along = np.array([0.0, 0.0, 1.0]) - run.ground.normal[2] * run.ground.normal
    along /= np.linalg.norm(along)
    on = run.ground.inliers[run.cloud.pixels[:, 1], run.cloud.pixels[:, 0]]
    some = np.random.default_rng(0).choice(len(on), min(2 * DOTS, len(on)), replace=False)
    ax = axes[1]
    ax.set_box_aspect(run.left.shape[0] / run.left.shape[1])
    for which, colour in ((~on, OFF_GROUND), (on, ON_GROUND)):
        here = run.cloud.points[some[which[some]]]
        ax.plot(
            here @ along,
            run.ground.height_of(here),
            ".",
            color=colour,
            markersize=1.2,
            rasterized=True,
            alpha=0.6,
        )
    ax.plot(0.0, run.ground.distance_m, "<", color="black", markersize=7)
    far = float(np.percentile(run.cloud.points @ along, 98))
    ax.set(
        xlabel="along the ground (m)", ylabel="height (m)", xlim=(-0.05 * far, 1.05 * far),
        ylim=(2 * low, max(top, run.ground.distance_m) * 1.1),
    )  # fmt: skip
    return figure


def truth(run: DepthRun) -> Figure | None:
    """Errors of disparity, and errors over their standard deviation."""
    if run.pair.truth_px is None:
        return None
    figure, axes = _two(run, extra=0.8)
    found = run.disparity
    error = found.map_px - run.pair.truth_px
    _show(axes[0], _paint(error, -3.0, 3.0, "RdBu_r", none=0.6), "")
    _bar(figure, axes[0], "RdBu_r", -3.0, 3.0, "error of disparity (px)")
    z = (error / found.std_px)[found.valid & np.isfinite(error)]
    ax = axes[1]
    ax.set_box_aspect(run.left.shape[0] / run.left.shape[1])
    grid = np.linspace(-6, 6, 121)
    ax.hist(np.clip(z, -6, 6), bins=grid, density=True, color="#56B4E9", label="error / σ")
    ax.plot(grid, np.exp(-0.5 * grid**2) / np.sqrt(2 * np.pi), color="black", label="normal")
    ax.set(xlabel="error / standard deviation", yticks=[])
    ax.legend(loc="upper right")
    return figure


def _two(run: DepthRun, extra: float = 0.3) -> tuple[Figure, NDArray[Any]]:
    """Two pictures beside each other."""
    height, width = run.left.shape[:2]
    figure, axes = blank(min(7.0, 5.4 * height / width) + extra, 1, 2)
    return figure, axes[0]


def _extent(run: DepthRun) -> tuple[float, float, float, float]:
    height, width = run.left.shape[:2]
    return -0.5, width - 0.5, height - 0.5, -0.5


def _thin(image: NDArray[Any]) -> NDArray[Any]:
    """At most as large as a page can show."""
    step = max(1, -(-max(image.shape[:2]) // (2 * LARGEST)))
    return image[::step, ::step]


def _show(ax: Axes, image: NDArray[Any], title: str) -> None:
    """An RGB picture without axes."""
    height, width = image.shape[:2]
    shown = image if image.dtype == np.uint8 else np.clip(np.rint(255 * image), 0, 255).astype(np.uint8)
    ax.imshow(_thin(shown), extent=(-0.5, width - 0.5, height - 0.5, -0.5), interpolation="antialiased")
    ax.axis("off")
    if title:
        ax.set_title(title, loc="center")


def _paint(values: NDArray[Any], low: float, high: float, name: str = NEAR_FAR, none: float = 0.92) -> Any:
    """Colours (h, w, 3) of numbers; those that are none in grey."""
    import matplotlib as mpl

    with np.errstate(invalid="ignore"):
        share = np.clip((values - low) / max(high - low, 1e-9), 0.0, 1.0)
    colours = mpl.colormaps[name](np.nan_to_num(share))[..., :3]
    colours[~np.isfinite(values)] = none
    return colours


def _bar(figure: Figure, ax: Axes, name: str, low: float, high: float, label: str) -> None:
    """A bar of colours under a picture."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    shown = ScalarMappable(Normalize(low, high), name)
    bar = figure.colorbar(shown, ax=ax, location="bottom", shrink=0.6, aspect=35, pad=0.02)
    bar.set_label(label)
