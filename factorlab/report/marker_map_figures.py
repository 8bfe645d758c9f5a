"""Figures of a marker map: the map, the way with its uncertainty, biases, and what corners miss by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import WIDTH, blank, legend_below, log_axis
from sequential.log import seconds
from sequential.manifold import SE3, rotation_matrix
from vision3d.rigid import compose

if TYPE_CHECKING:
    from factorlab.marker_map.beside import Beside
    from factorlab.marker_map.mapping import MarkerMap

__all__ = ["camera_covs", "filter_beside", "motion", "plan", "reprojection", "sigmas", "way"]

Array = NDArray[np.float64]
INK, WAY, BAND = "#222222", "#0072B2", "#D55E00"
AXES = ("#D55E00", "#009E73", "#0072B2")
VISIBLE = 0.02  # of the range of a curve: bands that are thinner are magnified


def camera_covs(found: MarkerMap) -> Array:
    """(F, 6, 6) covariances of world_T_camera, in the camera's axes."""
    carry = SE3().transport(SE3().identity(), found.body_T_camera)[0]
    covs: Array = carry @ found.frame_covs[:, :6, :6] @ carry.T
    return covs


def plan(found: MarkerMap) -> Figure:
    """From above, from the front, in perspective."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    way = compose(found.trajectory, found.body_T_camera)[:, 4:]
    level = found.inertial is not None
    views = (((0, 1), "from above"), ((0, 2), "from the front")) if level else (
        ((0, 2), "from above"), ((0, 1), "from the front"))  # fmt: skip
    times = _magnified(found)
    drawn = "" if times == 1 else f", 3σ drawn {times:g} times"
    for place, ((a, b), title) in enumerate(views, start=1):
        axes = figure.add_subplot(1, 3, place)
        _squares(axes, found, a, b, times)
        axes.plot(way[:, a], way[:, b], color=WAY, linewidth=0.9)
        axes.plot(way[0, a], way[0, b], "o", color=WAY, markersize=4)
        axes.set(xlabel=f"{'xyz'[a]}, m", ylabel=f"{'xyz'[b]}, m", title=title + drawn)
        axes.set_aspect("equal", adjustable="datalim")
        if not level and b == 1:
            axes.invert_yaxis()  # the reference marker's y points down
    space: Any = figure.add_subplot(1, 3, 3, projection="3d")
    order = (0, 1, 2) if level else (0, 2, 1)
    sign = np.array([1.0, 1.0, 1.0]) if level else np.array([1.0, 1.0, -1.0])
    for corners in found.corners():
        loop = corners[[0, 1, 2, 3, 0]][:, order] * sign
        space.plot(*loop.T, color=INK, linewidth=1.2)
    space.plot(*(way[:, order] * sign).T, color=WAY, linewidth=0.8)
    space.set_box_aspect(np.maximum(np.ptp(_everything(found, way)[:, order], axis=0), 0.05))
    space.tick_params(labelsize=7)
    space.set_title("in perspective")
    return figure


def _everything(found: MarkerMap, way: Array) -> Array:
    return np.vstack([found.corners().reshape(-1, 3), way])


def _magnified(found: MarkerMap) -> float:
    """By which power of ten ellipses are drawn larger, so that the largest is a third of a marker at most."""
    sigma = np.sqrt(np.max(np.einsum("kii->ki", found.marker_covs[found.placed][:, 3:, 3:]), initial=0.0))
    side = float(np.median(found.sightings.size_m))
    return float(10.0 ** np.clip(np.floor(np.log10(side / max(3.0 * sigma, 1e-9))), 0.0, 3.0))


def _squares(axes: Any, found: MarkerMap, a: int, b: int, times: float) -> None:
    """Outlines, numbers, normals and 3σ ellipses in the plane of two axes."""
    rows = np.flatnonzero(found.placed)
    for corners, k in zip(found.corners(), rows, strict=True):
        loop = corners[[0, 1, 2, 3, 0]]
        axes.plot(loop[:, a], loop[:, b], color=INK, linewidth=1.4)
        R, centre = rotation_matrix(found.poses[k, :4]), found.poses[k, 4:]
        out = centre - 0.6 * found.sightings.size_m[k] * R[:, 2]
        axes.plot([centre[a], out[a]], [centre[b], out[b]], color=BAND, linewidth=1.0)
        cov = R @ found.marker_covs[k][3:, 3:] @ R.T
        circle = np.linspace(0, 2 * np.pi, 40)
        values, vectors = np.linalg.eigh(cov[np.ix_([a, b], [a, b])])
        ring = (vectors * np.sqrt(np.maximum(values, 0.0))) @ np.array([np.cos(circle), np.sin(circle)])
        axes.fill(
            centre[a] + 3 * times * ring[0],
            centre[b] + 3 * times * ring[1],
            color=BAND,
            alpha=0.35,
            linewidth=0,
        )
        axes.annotate(
            str(found.sightings.ids[k]),
            (centre[a], centre[b]),
            xytext=(6, 6),
            textcoords="offset points",
            fontsize=8,
        )


def _gaps(t: Array, values: Array) -> tuple[Array, Array]:
    """Break lines where frames are missing."""
    usual = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    cut = np.flatnonzero(np.diff(t) > max(6 * usual, 0.5)) + 1
    return np.insert(t, cut, np.nan), np.insert(values, cut, np.nan, axis=0)


def way(found: MarkerMap) -> Figure:
    """Place and orientation against time, with bands of 3σ."""
    figure, axes = blank(5.2, 2, 3, sharex=True)
    t = seconds(found.t, int(found.t[0]))
    R = rotation_matrix(found.trajectory[:, :4])
    world = np.einsum("kij,kjl,kml->kim", R, found.frame_covs[:, 3:6, 3:6], R)
    place_sigma = np.sqrt(np.einsum("kii->ki", world))
    turned = np.degrees(SE3().local(found.trajectory[:1], found.trajectory)[:, :3])
    turn_sigma = np.degrees(np.sqrt(np.einsum("kii->ki", found.frame_covs[:, :3, :3])))
    for k, name in enumerate("xyz"):
        _banded(axes[0, k], t, found.trajectory[:, 4 + k], place_sigma[:, k], f"{name}, m")
        _banded(axes[1, k], t, turned[:, k], turn_sigma[:, k], f"turn about {name}, °")
        axes[1, k].set_xlabel("time, s")
    return figure


def _banded(axes: Any, t: Array, value: Array, sigma: Array, label: str) -> None:
    width, reach = 3.0 * sigma, float(np.ptp(value)) or 1.0
    times = 1.0
    while times * np.median(width) < VISIBLE * reach and times < 1e4:
        times *= 10.0
    at, rows = _gaps(t, np.column_stack([value, width * times]))
    axes.fill_between(
        at, rows[:, 0] - rows[:, 1], rows[:, 0] + rows[:, 1], color=BAND, alpha=0.35, linewidth=0
    )
    axes.plot(at, rows[:, 0], color=WAY, linewidth=1.0)
    axes.set_ylabel(label)
    if times > 1:
        axes.set_title(f"3σ drawn {times:g} times", fontsize=8, color="#555555")


def motion(found: MarkerMap) -> Figure | None:
    """Velocity, accelerometer bias and gyro bias with 3σ."""
    if found.velocities is None or found.biases is None:
        return None
    figure, axes = blank(3.0, 1, 3)
    t = seconds(found.t, int(found.t[0]))
    sigma = np.sqrt(np.einsum("kii->ki", found.frame_covs))
    parts = (
        (found.velocities, sigma[:, 6:9], "velocity, m/s"),
        (found.biases[:, :3], sigma[:, 9:12], "accelerometer bias, m/s²"),
        (np.degrees(found.biases[:, 3:]), np.degrees(sigma[:, 12:15]), "gyro bias, °/s"),
    )
    for ax, (values, width, label) in zip(axes[0], parts, strict=True):
        for k, colour in enumerate(AXES):
            at, rows = _gaps(t, np.column_stack([values[:, k], 3 * width[:, k]]))
            ax.fill_between(
                at, rows[:, 0] - rows[:, 1], rows[:, 0] + rows[:, 1], color=colour, alpha=0.2, linewidth=0
            )
            ax.plot(at, rows[:, 0], color=colour, linewidth=1.0, label="xyz"[k])
        ax.set(xlabel="time, s", ylabel=label)
    legend_below(figure, axes[0, 0])
    return figure


def sigmas(found: MarkerMap, alone: MarkerMap) -> Figure:
    """Sigmas of the camera's place and orientation, with the IMU and without."""
    figure, axes = blank(3.0, 1, 2)
    for one, colour, label in ((alone, BAND, "camera alone"), (found, WAY, "camera and IMU")):
        t = (one.t - (round(1e9 * found.inertial.offset_s) if one is found and found.inertial else 0)) * 1e-9
        covs = camera_covs(one)
        place = 1e3 * np.sqrt(np.trace(covs[:, 3:, 3:], axis1=1, axis2=2))
        turn = np.degrees(np.sqrt(np.trace(covs[:, :3, :3], axis1=1, axis2=2)))
        for ax, values, unit in (
            (axes[0, 0], place, "σ of place, mm"),
            (axes[0, 1], turn, "σ of orientation, °"),
        ):
            at, rows = _gaps(t - alone.t[0] * 1e-9, values[:, None])
            ax.plot(at, rows[:, 0], color=colour, label=label)
            ax.set(xlabel="time, s", ylabel=unit)
            log_axis(ax)
    legend_below(figure, axes[0, 0])
    return figure


def filter_beside(told: Beside) -> Figure:
    """Smoother less filter by axis with the filter's 3σ, and the sigmas of both."""
    figure, axes = blank(3.0, 1, 4, sharex=True)
    t = seconds(told.t, int(told.t[0]))
    for k, name in enumerate("xyz"):
        at, rows = _gaps(t, 1e3 * np.column_stack([told.place_apart[:, k], 3 * told.place_sigma[:, k]]))
        axes[0, k].fill_between(at, -rows[:, 1], rows[:, 1], color=BAND, alpha=0.25, linewidth=0)
        axes[0, k].plot(at, rows[:, 0], color=WAY, linewidth=0.9)
        axes[0, k].set(ylabel=f"{name}, mm", xlabel="time, s")
    for sigma, colour, label in (
        (told.filter_sigma, BAND, "filter"), (told.smoother_sigma, WAY, "smoother"),
    ):  # fmt: skip
        at, rows = _gaps(t, 1e3 * sigma[:, 1:])
        axes[0, 3].plot(at, rows[:, 0], color=colour, label=label)
    axes[0, 3].set(ylabel="σ of place, mm", xlabel="time, s", ylim=(0, None))
    legend_below(figure, axes[0, 3])
    return figure


def reprojection(found: MarkerMap) -> Figure:
    """Errors of corners in the picture, χ² of sightings, and errors by marker."""
    from scipy.stats import chi2 as chi_square

    figure, axes = blank(3.6, 1, 3)
    sightings, error, taken = found.sightings, found.misses(), found.gated.taken
    rejected = found.gated.rejected
    reach = max(0.3, 1.3 * float(np.nanquantile(np.abs(error[taken]), 0.999))) if taken.any() else 1.0
    for mask, colour, label, size in ((taken, WAY, "taken", 1.5), (rejected, BAND, "rejected", 4.0)):
        axes[0, 0].plot(
            *np.clip(error[mask].reshape(-1, 2).T, -reach, reach),
            ".",
            color=colour,
            markersize=size,
            label=label,
        )
    axes[0, 0].set(xlabel="x, px", ylabel="y, px", xlim=(-reach, reach), ylim=(-reach, reach))
    axes[0, 0].set_aspect("equal")
    told = found.chi2[np.isfinite(found.chi2)]
    axes[0, 1].hist(told, bins=40, range=(0, 30), density=True, color=WAY, alpha=0.5, label="sightings")
    line = np.linspace(0, 30, 200)
    axes[0, 1].plot(line, chi_square.pdf(line, 8), color=INK, label="χ² of eight")
    axes[0, 1].set(xlabel="χ² of a sighting", ylabel="density")
    axes[0, 1].legend()
    numbers = np.flatnonzero(found.placed)
    squares = [np.sum(error[taken & (sightings.marker == k)] ** 2, axis=-1) for k in numbers]
    rms = [float(np.sqrt(square.mean())) if square.size else 0.0 for square in squares]
    axes[0, 2].bar([str(sightings.ids[k]) for k in numbers], rms, color=WAY)
    axes[0, 2].set(xlabel="marker", ylabel="RMS of a corner, px")
    axes[0, 0].legend(loc="upper right")
    return figure
