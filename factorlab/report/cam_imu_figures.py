"""Figures of a camera-IMU calibration: clocks, residuals, biases, the path before the board."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from factorlab.report.style import blank, legend_below, thin

if TYPE_CHECKING:
    from factorlab.cam_imu.job import CamImuRun

__all__ = ["biases", "clocks", "corner_residuals", "inertial_residuals", "trajectory"]

Array = NDArray[np.float64]
AXES = (("x", "#D55E00"), ("y", "#009E73"), ("z", "#0072B2"))
BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "#9a9a9a"
MOST_DOTS = 4000


def clocks(run: CamImuRun) -> Figure:
    """Which offset makes the gyro turn as the camera does."""
    found = run.found
    aligned = found.aligned
    shift = run.time_offset_s - found.time_offset_s
    figure, axes = blank(3.2, 1, 2, gridspec_kw={"width_ratios": (1, 1.6)})
    curve, speed = axes[0]
    known = aligned.correlations > -1.0
    far = abs(shift) > 100.0
    offsets = aligned.offsets_s[known] + (0.0 if far else shift)
    rows = thin(len(offsets), 3000)
    curve.plot(offsets[rows], aligned.correlations[known][rows], color=BLUE)
    at = found.time_offset_s + (0.0 if far else shift)
    curve.axvline(at, color="black", linestyle="--", linewidth=0.8)
    curve.set(xlabel="offset of the clocks, s" if not far else "offset, s from the recordings' beginnings")
    curve.set(ylabel="correlation", ylim=(-1.0, 1.05))
    state = found.adjusted.state
    imu = found.problem.imu
    t = imu.t
    bias, _ = state.biases(t)
    rows = thin(len(t), 3000)
    speed.plot(t[rows], np.degrees(np.linalg.norm(imu.gyro - bias, axis=1))[rows], color=ORANGE, label="gyro")
    moments = found.problem.corners.t + state.time_offset_s
    from sequential.manifold import SO3
    from vision3d.rigid import inverse

    q = inverse(found.poses.camera_T_board)[:, :4]
    near = np.diff(moments) < 3.0 * np.median(np.diff(moments))
    turns = np.linalg.norm(SO3().local(q[:-1], q[1:]), axis=1) / np.diff(moments)
    middles = 0.5 * (moments[1:] + moments[:-1])
    speed.plot(
        middles[near], np.degrees(turns[near]), ".", color="black", markersize=3, label="pairs of frames"
    )
    speed.set(xlabel="time, s", ylabel="speed of turning, °/s")
    speed.set_ylim(0.0, 1.3 * float(np.degrees(np.quantile(np.linalg.norm(imu.gyro - bias, axis=1), 0.999))))
    legend_below(figure, speed)
    return figure


def inertial_residuals(run: CamImuRun) -> Figure:
    """Residuals of gyro and accelerometer over time, with ±3σ."""
    found = run.found
    problem, linear = found.problem, found.adjusted.linear
    t = problem.imu.t
    figure, axes = blank(4.2, 2, 1, sharex=True)
    for ax, rows, sigma, gain, unit in (
        (axes[0, 0], linear.gyro, problem.gyro_sigma, float(np.degrees(1.0)), "gyro, °/s"),
        (axes[1, 0], linear.accel, problem.accel_sigma, 1.0, "accelerometer, m/s²"),
    ):
        chosen = thin(len(t), MOST_DOTS)
        ax.axhspan(-3.0 * gain * sigma, 3.0 * gain * sigma, color="#e6e6e6", zorder=0)
        for k, (name, colour) in enumerate(AXES):
            values = -gain * sigma * rows.e[:, k]
            ax.plot(t[chosen], values[chosen], ".", color=colour, markersize=1.6, label=name)
        out = rows.weight == 0.0
        if out.any():
            ax.plot(t[out], -gain * sigma * rows.e[out].max(axis=1), "x", color="black", label="left out")
        ax.set(ylabel=unit, ylim=(-6.0 * gain * sigma, 6.0 * gain * sigma))
    axes[1, 0].set(xlabel="time, s")
    legend_below(figure, axes[0, 0])
    return figure


def corner_residuals(run: CamImuRun) -> Figure:
    """Residuals of corners, and RMS frame by frame."""
    found = run.found
    problem = found.problem
    corners, weight = problem.corners, problem.corner_weight
    residuals = -found.adjusted.linear.residuals_px
    used = weight > 0.0
    figure, axes = blank(3.8, 1, 2, gridspec_kw={"width_ratios": (1, 2.0)})
    cloud, frames = axes[0]
    rows = np.flatnonzero(used)
    rows = rows[thin(len(rows), MOST_DOTS)]
    cloud.plot(*residuals[rows].T, ".", color=BLUE, markersize=1.5, alpha=0.5)
    sigma = problem.corner_scale * float(np.median(corners.sigma_px))
    for k in (1, 2, 3):
        cloud.add_patch(Circle((0.0, 0.0), k * sigma, fill=False, color="black", linewidth=0.8))
    reach = max(4.5 * sigma, 1.1 * float(np.quantile(np.abs(residuals[rows]), 0.999)))
    cloud.set(xlim=(-reach, reach), ylim=(reach, -reach), xlabel="x, px", ylabel="y, px")
    cloud.set_aspect("equal")
    squares = np.sum(residuals**2, axis=1)
    counted = np.maximum(np.bincount(corners.frame, used, minlength=len(corners.t)), 1.0)
    rms = np.sqrt(np.bincount(corners.frame, squares * used, minlength=len(corners.t)) / counted)
    good = found.frames_used
    frames.plot(corners.t[good], rms[good], ".", color=BLUE, markersize=4, label="frames")
    if (~good).any():
        own = np.sqrt(
            np.bincount(corners.frame, squares, minlength=len(corners.t))
            / np.bincount(corners.frame, minlength=len(corners.t))
        )
        top = 1.4 * float(rms[good].max())
        frames.plot(corners.t[~good], np.minimum(own[~good], top), "x", color=ORANGE, label="left out")
    frames.set(xlabel="time of the camera, s", ylabel="RMS, px")
    frames.set_ylim(bottom=0.0)
    legend_below(figure, frames)
    return figure


def biases(run: CamImuRun) -> Figure:
    """Biases at their nodes with ±3σ."""
    found = run.found
    state = found.adjusted.state
    t = state.grid.node_times
    stds = found.bias_std()
    figure, axes = blank(4.6, 2, 3, sharex=True)
    rig = None if run.truth is None else run.truth.rig
    for row, values, std, gain, label, truth in (
        (
            0,
            state.gyro_bias,
            stds[0],
            float(np.degrees(1.0)),
            "gyro, °/s",
            None if rig is None else rig.gyro_bias,
        ),
        (1, state.accel_bias, stds[1], 1.0, "accelerometer, m/s²", None if rig is None else rig.accel_bias),
    ):
        for k, (name, colour) in enumerate(AXES):
            ax = axes[row, k]
            ax.plot(t, gain * values[:, k], color=colour, marker=".", label=f"estimate, {name}")
            low, high = (gain * (values[:, k] + sign * 3.0 * std[:, k]) for sign in (-1.0, 1.0))
            ax.fill_between(t, low, high, color=colour, alpha=0.18, linewidth=0.0)
            if truth is not None:
                ax.plot(t[0], gain * truth[k], "k+", markersize=9, label="truth at the beginning")
            ax.set(title=f"{label}, {name}")
            ax.ticklabel_format(useOffset=False)
    for ax in axes[1]:
        ax.set(xlabel="time, s")
    return figure


def trajectory(run: CamImuRun) -> Figure:
    """The path from two sides, the board, and rays to the camera."""
    found = run.found
    state = found.adjusted.state
    t = found.problem.imu.t
    R, _, position, _, _ = state.motion(t)
    outline = np.vstack([run.job.board.outline, run.job.board.outline[:1]])
    chosen = np.linspace(0, len(t) - 1, 25).astype(int)
    from vision3d.rigid import inverse

    lever = inverse(state.camera_T_imu)[4:]
    cameras = position[chosen] + np.einsum("nij,j->ni", R[chosen], lever)
    figure, axes = blank(4.2, 1, 2)
    gaps = np.flatnonzero(np.diff(t) > 10.0 * np.median(np.diff(t))) + 1
    path = np.insert(position, gaps, np.nan, axis=0)
    look: dict[str, Any] = {"linewidth": 0.9}
    for ax, (i, j), title in (
        (axes[0, 0], (0, 1), "as the board is looked at"),
        (axes[0, 1], (2, 1), "from its side"),
    ):
        ax.plot(path[:, i], path[:, j], color=BLUE, label="IMU", **look)
        for a, b in zip(position[chosen], cameras, strict=True):
            ax.plot([a[i], b[i]], [a[j], b[j]], color=ORANGE, linewidth=1.2)
        ax.plot(
            cameras[:, i], cameras[:, j], "o", color=ORANGE, markersize=2.5, label="camera, at some moments"
        )
        ax.plot(outline[:, i], outline[:, j], color="black", linewidth=1.5, label="board")
        down = state.gravity / np.linalg.norm(state.gravity)
        size = 0.35 * float(np.ptp(position[:, :2], axis=0).max())
        start = outline[:4].mean(axis=0)
        ax.annotate(
            "", xy=(start[i] + size * down[i], start[j] + size * down[j]), xytext=(start[i], start[j]),
            arrowprops={"arrowstyle": "->", "color": "#009E73"},
        )  # fmt: skip
        ax.plot([], [], color="#009E73", label="gravity")
        ax.set(xlabel=f"{'xyz'[i]} of the board, m", ylabel=f"{'xyz'[j]} of the board, m", title=title)
        ax.set_aspect("equal", adjustable="datalim")
        if not ax.yaxis_inverted():
            ax.invert_yaxis()
    legend_below(figure, axes[0, 0])
    return figure
