"""Figures of a stereo calibration: a rectified pair, rows, the cameras' pose pair by pair, residuals, σ."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from factorlab.report.camera_figures import frame_axes, height_of
from factorlab.report.stereo_pictures import rectified_pairs
from factorlab.report.style import blank, legend_below, log_axis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from factorlab.stereo.calibrated import CalibratedStereo

__all__ = ["depth_spread", "pair_poses", "rectified_pair", "residual_fields", "row_differences"]

FITTED, LEFT_OUT, SOFT, GREEN = "#0072B2", "#D55E00", "#9a9a9a", "#009E73"
AXES = (("x", "#D55E00"), ("y", "#009E73"), ("z", "#0072B2"))


def rectified_pair(done: CalibratedStereo) -> Figure | None:
    """Both rectified images of a pair, and lines that go through the same things in both."""
    images = {pair.name: (pair.left, pair.right) for pair in done.pictures.pairs}
    fit = done.calibration
    names = [fit.pairs[v].name for v in fit.whole if None not in images.get(fit.pairs[v].name, (None, None))]
    if not names:
        return None
    left, right = images[names[len(names) // 2]]
    assert left is not None  # noqa: S101 - chosen so
    assert right is not None  # noqa: S101 - chosen so
    pair = done.rectification
    images_rectified = pair.images(left[1], right[1])
    return rectified_pairs([(left[0].rsplit(".", 1)[0], *images_rectified)], pair.axis, pair.valid)


def row_differences(done: CalibratedStereo) -> Figure | None:
    """How far apart rows are: over the rectified image, and pair by pair."""
    fit, pair, sizes = done.calibration, done.rectification, done.measured
    figure, axes = blank(height_of(pair.size), 1, 2, gridspec_kw={"width_ratios": (1.1, 1)})
    field, bars = axes[0]
    at, errors = _rows(done)
    reach = float(np.quantile(np.abs(errors), 0.99)) if len(errors) else 1.0
    dots = field.scatter(
        *at.T, c=errors, s=9, cmap="RdBu_r", vmin=-reach, vmax=reach, linewidths=0.15, edgecolors="#555"
    )  # fmt: skip
    figure.colorbar(dots, ax=field, shrink=0.85, label="right less left, px")
    frame_axes(field, pair.size)
    field.set_title(f"{'columns' if pair.axis else 'rows'} apart, in the rectified left image")
    whole = list(fit.whole)
    k = np.arange(len(whole))
    moved = set(done.deviations.moved)
    colours = [LEFT_OUT if v in moved else FITTED for v in whole]
    bars.bar(k, sizes.pair_row_px[whole], 0.7, color=colours, alpha=0.75)
    bars.plot([], [], "s", color=FITTED, markersize=8, label="fitted")
    if moved:
        bars.plot([], [], "s", color=LEFT_OUT, markersize=8, label="its own pose of the cameras differs")
    if done.held is not None:
        bars.plot(k, done.held.pair_row_px[whole], "D", color="black", markersize=4, label="left out")
    bars.axhline(
        sizes.row_px, color="black", linestyle="--", linewidth=0.8, label=f"all, {sizes.row_px:.3f} px"
    )
    _named(bars, [_short(fit.pairs[v].name) for v in whole])
    bars.set(ylabel="RMS, px")
    legend_below(figure, bars)
    return figure


def pair_poses(done: CalibratedStereo) -> Figure | None:
    """What every pair alone says of the cameras' pose, against that of all; bars are 2σ."""
    found = done.deviations
    figure, axes = blank(3.4, 1, 2)
    names = [_short(done.calibration.pairs[v].name) for v in found.pairs]
    k = np.arange(len(names))
    std = np.sqrt(np.einsum("vii->vi", found.covs))
    for ax, first, gain, label in (
        (axes[0, 0], 0, float(np.degrees(1.0)), "rotation, °"),
        (axes[0, 1], 3, 1e3, "translation, mm"),
    ):
        ax.axhline(0.0, color="black", linewidth=0.8)
        for j, (name, colour) in enumerate(AXES):
            column = first + j
            ax.errorbar(
                k + 0.2 * (j - 1),
                gain * found.steps[:, column],
                2.0 * gain * std[:, column],
                fmt="o", color=colour, markersize=3.5, linewidth=1.0, label=name,
            )  # fmt: skip
        if found.step is not None:
            ax.axvline(
                found.pairs.index(found.step.after) - 0.5, color=LEFT_OUT, linestyle="--", linewidth=1.2
            )
        _named(ax, names)
        ax.set_title(f"{label}, in the left camera's axes")
    legend_below(figure, axes[0, 0])
    return figure


def residual_fields(done: CalibratedStereo) -> Figure | None:
    """Every residual of the left and of the right images as an arrow."""
    fit = done.calibration
    figure, axes = blank(height_of(fit.rig.left.size), 1, 2)
    for side, (ax, camera, name) in enumerate(
        zip(axes[0], (fit.rig.left, fit.rig.right), ("left", "right"), strict=True)
    ):
        chosen = [k for k, (own, _) in enumerate(fit.pictures) if own == side]
        views = [fit.pairs[fit.pictures[k][1]] for k in chosen]
        pixels = np.concatenate(
            [view.pixels for one in views if (view := one.left if side == 0 else one.right) is not None]
        )
        residuals = np.concatenate([fit.residuals[k] for k in chosen])
        used = np.concatenate([fit.weights[k] for k in chosen]) > 0.0
        rms = float(np.sqrt((residuals[used] ** 2).sum(axis=1).mean()))
        gain = 0.03 * camera.size[0] / max(rms, 1e-6)
        _arrows(ax, pixels[used], residuals[used], gain, FITTED)
        if (~used).any():
            _arrows(ax, pixels[~used], residuals[~used], gain, LEFT_OUT)
        frame_axes(ax, camera.size)
        ax.set_title(f"{name}: measured − predicted, {gain:.0f} times enlarged")
    return figure


def depth_spread(done: CalibratedStereo) -> Figure | None:
    """σ of rows over the rectified image, and σ of depths over distance."""
    pair, sure = done.rectification, done.uncertainty
    figure, axes = blank(height_of(pair.size), 1, 2, gridspec_kw={"width_ratios": (1.1, 1)})
    field, curve = axes[0]
    columns = len(np.unique(sure.pixels[:, 0]))
    x, y = sure.pixels[:columns, 0], sure.pixels[::columns, 1]
    values = sure.row_std_px.reshape(-1, columns)
    levels = _levels(values)
    clipped = np.clip(values, levels[0], levels[-1])
    shown = field.contourf(x, y, clipped, levels=levels, cmap="viridis", norm="log")
    lines = field.contour(x, y, values, levels=levels, colors="white", linewidths=0.6)
    field.clabel(lines, fmt=lambda value: f"{value:g}", fontsize=8)
    figure.colorbar(shown, ax=field, shrink=0.85, label="σ of rows, px", format="%g", ticks=levels)
    at, _ = _rows(done)
    field.plot(*at.T, ".", color="white", markersize=1.2, alpha=0.6)
    frame_axes(field, pair.size)
    field.set_title(f"σ of rows from the rig, things {done.distance_m:.2f} m away")
    depths, std = done.depth_spread
    noise = depths**2 / abs(pair.focal_px * pair.baseline_m) * MATCHED_PX
    for values_m, colour, style, label in (
        (std, FITTED, "-", "the rig"),
        (noise, GREEN, "--", f"matching to {MATCHED_PX:g} px"),
        (np.hypot(std, noise), "black", ":", "both"),
    ):
        curve.plot(depths, 100.0 * values_m / depths, color=colour, linestyle=style, label=label)
    log_axis(curve, "xy")
    for axis in (curve.xaxis, curve.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    curve.axvline(done.distance_m, color=SOFT, linewidth=0.8)
    curve.set(xlabel="depth, m", ylabel="σ of the depth, %")
    curve.set_title("σ of a depth in the middle of the image")
    legend_below(figure, curve)
    return figure


MATCHED_PX = 0.25  # what a dense matcher reaches on good texture


def _levels(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """1, 2, 3, 5 of every decade, from below the smallest value to above the largest; twelve at most."""
    series = (np.array([1.0, 2.0, 3.0, 5.0])[None] * 10.0 ** np.arange(-5, 4)[:, None]).ravel()
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    first = max(0, int(np.searchsorted(series, low, side="right")) - 1)
    last = min(len(series) - 1, int(np.searchsorted(series, high)))
    levels: NDArray[np.float64] = series[first : max(last, first + 2) + 1][:12]
    return levels


def _rows(done: CalibratedStereo) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (N, 2) in the rectified left image, and how far their rows are apart (N,)."""
    from vision3d.stereo.row_errors import row_errors_of
    from vision3d.stereo.view_pairs import ViewPair

    fit, places, errors = done.calibration, [], []
    for v in fit.whole:
        pair, (a, b) = fit.pairs[v], fit.weights_of_pair(v)
        assert pair.left is not None  # noqa: S101 - whole
        assert pair.right is not None  # noqa: S101 - whole
        kept = ViewPair(pair.name, pair.left.subset(a > 0.0), pair.right.subset(b > 0.0))
        left, right = kept.common()
        places.append(done.rectification.points(left.pixels, right.pixels)[0])
        errors.append(row_errors_of(done.rectification, kept))
    return np.concatenate(places), np.concatenate(errors)


def _short(name: str) -> str:
    """The left picture's name stands for a pair."""
    return name.split(" + ", maxsplit=1)[0].rsplit(".", 1)[0]


def _named(ax: Axes, names: list[str]) -> None:
    step = -(-len(names) // 26)
    turned = len(names) > 5
    ax.set_xticks(
        np.arange(len(names))[::step],
        names[::step],
        rotation=40 if turned else 0,
        ha="right" if turned else "center",
    )
    ax.set(xlim=(-0.6, len(names) - 0.4))
    ax.grid(visible=False, axis="x")


def _arrows(ax: Axes, at: NDArray[Any], what: NDArray[Any], gain: float, colour: str) -> None:
    look: dict[str, Any] = {
        "angles": "xy",
        "scale_units": "xy",
        "scale": 1.0,
        "width": 0.002,
        "color": colour,
    }
    ax.quiver(at[:, 0], at[:, 1], gain * what[:, 0], gain * what[:, 1], **look)
