"""Maps of SLAM problems, and errors beside what the estimators say about them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.compare.text import figure
from factorlab.report.style import blank, legend_below, line_of, log_axis, thin, widths
from factorlab.slam.engine import SlamComparison, SlamRow
from factorlab.slam.estimators import KINDS
from factorlab.slam.scores import positions
from sequential.manifold import SE2

__all__ = ["slam_consistency", "slam_envelopes", "slam_errors", "slam_map"]

Array = NDArray[np.float64]
RADII_95 = 2.4477  # √χ²(2) at 95 %
FINAL = ("batch", "batch_robust", "gnc", "isam2_final")


def final_of(comparison: SlamComparison) -> SlamRow | None:
    """The batch, or else the best stand-in for it that was solved."""
    return next((row for name in FINAL if (row := comparison.row(name)) is not None), None)


def online_of(comparison: SlamComparison) -> SlamRow | None:
    """The first estimate made while driving."""
    return next((row for row in comparison.rows if not row.failed and KINDS[row.name].part == "online"), None)


def slam_map(comparison: SlamComparison) -> Figure | None:
    """Trajectories and landmarks; a spatial problem from above and from the side."""
    if comparison.all_failed:
        return None
    planes = ((0, 1),) if comparison.dataset.axes == 2 else ((0, 1), (0, 2))
    drawing, axes = blank(6.6 if len(planes) == 1 else 5.6, 1, len(planes))
    for one, plane in zip(axes[0], planes, strict=True):
        _plane(one, comparison, plane)
    legend_below(drawing, axes[0, 0])
    return drawing


def _plane(axes: Axes, comparison: SlamComparison, plane: tuple[int, int]) -> None:
    dataset, which = comparison.dataset, list(plane)
    if dataset.truth is not None and dataset.aligned == "none":
        place = dataset.truth.position[thin(len(dataset.truth))][:, which]
        axes.plot(*place.T, color="#888888", linewidth=2.5, alpha=0.6, label="truth")
    shown = [row for row in comparison.rows if not row.failed]
    for row, width in zip(shown, widths(len(shown)), strict=True):
        path = positions(row.trajectory, dataset.axes)  # type: ignore[arg-type]  # failed rows are left out
        axes.plot(
            *path[thin(len(path), 6000)][:, which].T, linewidth=width, label=row.title, **line_of(row.name)
        )
    best = final_of(comparison)
    if best is not None and plane == (0, 1):
        _landmarks(axes, comparison, best)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel=f"{'xyz'[plane[0]]}, m", ylabel=f"{'xyz'[plane[1]]}, m")


def _landmarks(axes: Axes, comparison: SlamComparison, best: SlamRow) -> None:
    """Estimated places with their ellipses, true ones beside them."""
    if best.run is None or "l" not in best.run.values.index:
        return
    place = best.run.values.rows["l"]
    axes.plot(*place[:, :2].T, "+", color="#222222", markersize=6, label=f"landmarks, {best.title}", zorder=4)
    cov = best.run.covs.get("l")
    if cov is not None and np.isfinite(cov).all():
        spread, axis = np.linalg.eigh(cov[:, :2, :2])
        wide = 2 * RADII_95 * np.sqrt(np.maximum(spread, 0.0))
        reach = 0.5 * wide.max(axis=1, keepdims=True)
        axes.update_datalim(np.vstack([place[:, :2] - reach, place[:, :2] + reach]))
        angle = np.degrees(np.arctan2(axis[:, 1, 1], axis[:, 0, 1]))
        axes.add_collection(
            EllipseCollection(
                wide[:, 1], wide[:, 0], angle, units="xy", offsets=place[:, :2],
                transOffset=axes.transData, facecolors="none", edgecolors="#222222", linewidths=0.7,
            )
        )  # fmt: skip
    if comparison.dataset.landmarks and comparison.dataset.aligned == "none":
        true = np.stack(list(comparison.dataset.landmarks.values()))
        axes.plot(
            *true[:, :2].T, "o", color="#888888", fillstyle="none", markersize=7, label="true landmarks"
        )


def _scored(comparison: SlamComparison) -> list[SlamRow]:
    return [row for row in comparison.rows if row.scores is not None]


def _times(comparison: SlamComparison, row: SlamRow) -> tuple[Array, str]:
    """Times of a row's scores and what they count."""
    assert row.scores is not None  # noqa: S101 - scored rows only
    t = (row.scores.t - row.scores.t[0]) * 1e-9
    return t, "pose" if comparison.dataset.problem.t is None else "time since the start, s"


def slam_errors(comparison: SlamComparison) -> Figure | None:
    """Length of the position error of every estimator."""
    rows = _scored(comparison)
    if not rows:
        return None
    drawing, axes = blank(3.6)
    one = axes[0, 0]
    label = ""
    for row, width in zip(rows, widths(len(rows)), strict=True):
        t, label = _times(comparison, row)
        length = np.maximum(np.linalg.norm(row.scores.error, axis=1), 1e-4)  # type: ignore[union-attr]
        kept = thin(len(t))
        told = f"{row.title}: {figure(row.scores.rmse)} m"  # type: ignore[union-attr]
        one.plot(t[kept], length[kept], linewidth=width, label=told, **line_of(row.name))
    log_axis(one)
    against = rows[0].scores.against  # type: ignore[union-attr]
    one.set(xlabel=label, ylabel="error, m")
    one.set_title(f"distance to {against}; the legend gives the RMSE")
    legend_below(drawing, one, 4)
    return drawing


def slam_envelopes(comparison: SlamComparison) -> Figure | None:
    """Pose error within ±3σ, direction by direction: while driving beside at the end."""
    chosen = [online_of(comparison), final_of(comparison)]
    rows = [row for row in chosen if row is not None and row.scores is not None and row.scores.honesty]
    if not rows:
        return None
    names = _directions(rows[0])
    drawing, axes = blank(1.6 * len(names) + 0.6, len(names), len(rows), sharex=True)
    for column, row in enumerate(rows):
        for k, (name, unit, scale) in enumerate(names):
            _envelope(comparison, axes[k, column], row, k, f"{name}, {unit}", scale)
        axes[-1, column].set_xlabel(_times(comparison, row)[1])
    return drawing


def _directions(row: SlamRow) -> list[tuple[str, str, float]]:
    """Name, unit and scale of each direction of the pose's chart."""
    degrees = float(np.degrees(1.0))
    assert row.trajectory is not None and row.scores is not None  # noqa: S101, PT018 - scored rows
    if row.scores.pose.metres:
        return [(axis, "m", 1.0) for axis in "xyz"[: row.scores.error.shape[1]]]
    if isinstance(row.trajectory.manifold, SE2):
        return [("ahead", "m", 1.0), ("left", "m", 1.0), ("heading", "°", degrees)]
    turns = [(f"turn about {axis}", "°", degrees) for axis in "xyz"]
    return [*turns, *((axis, "m", 1.0) for axis in "xyz")]


def _envelope(comparison: SlamComparison, axes: Axes, row: SlamRow, k: int, name: str, scale: float) -> None:
    assert row.scores is not None  # noqa: S101 - the caller has looked
    t, _ = _times(comparison, row)
    e = scale * row.scores.pose.error[:, k]
    three = scale * 3 * np.sqrt(row.scores.pose.cov[:, k, k])
    inside = 100 * float(np.mean(np.abs(e) <= three))
    kept, color = thin(len(t)), line_of(row.name)["color"]
    axes.fill_between(t[kept], -three[kept], three[kept], color=color, alpha=0.18, linewidth=0)
    axes.plot(t[kept], e[kept], color=color, linewidth=0.9)
    reach = 1.15 * max(float(np.quantile(np.abs(e), 0.999)), float(np.quantile(three, 0.9)))
    axes.set_ylim(-reach, reach)
    axes.set_ylabel(name)
    axes.set_title(f"{row.title}: {inside:.1f} % inside ±3σ (99.7 % expected)")


def slam_consistency(comparison: SlamComparison) -> Figure | None:
    """Normalised error of the pose over time, per degree of freedom."""
    rows = [row for row in _scored(comparison) if row.scores is not None and row.scores.honesty is not None]
    if not rows:
        return None
    drawing, axes = blank(3.4)
    one, label = axes[0, 0], ""
    for row in rows:
        assert row.scores is not None and row.scores.honesty is not None  # noqa: S101, PT018 - chosen by it
        t, label = _times(comparison, row)
        per = np.maximum(row.scores.pose.normalised() / row.scores.pose.error.shape[1], 1e-3)
        mean = row.scores.honesty.mean / row.scores.honesty.expected
        kept = thin(len(t))
        told = f"{row.title}: mean {figure(mean)}"
        one.plot(t[kept], per[kept], linewidth=0.9, label=told, **line_of(row.name))
    one.axhline(1.0, color="#444444", linewidth=0.8)
    log_axis(one)
    one.set(xlabel=label, ylabel="normalised error / freedom")
    one.set_title("squared error of the pose over its covariance; 1 is honest")
    legend_below(drawing, one, 4)
    return drawing
