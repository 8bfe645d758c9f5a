"""Orientation over time with its bands, gyro bias, what was held to be rest or disturbance, and errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import blank, legend_below, thin
from sequential.attitude import roll_pitch_yaw
from sequential.evaluate import attitude_error
from sequential.manifold.quaternion import quaternion_multiply, rotation_matrix

if TYPE_CHECKING:
    from factorlab.attitude import Reference, Solved

__all__ = ["angles", "biases", "errors", "moments", "spread"]

Array = NDArray[np.float64]
# Okabe and Ito's colours
LOOKS: dict[str, dict[str, Any]] = {
    "error-state": {"color": "#0072B2"},
    "smoother": {"color": "#D55E00", "linestyle": "--"},
    "mahony": {"color": "#009E73", "linestyle": "-."},
    "madgwick": {"color": "#CC79A7", "linestyle": ":"},
    "complementary": {"color": "#8A6D00", "linestyle": "--"},
    "kalman": {"color": "#56B4E9", "linestyle": "-."},
}
# the ports of the firmware have their models' colours
LOOKS |= {
    f"c-{name}{kind}": {"color": LOOKS[name]["color"], "linestyle": dashes}
    for name in ("error-state", "mahony", "complementary", "kalman")
    for kind, dashes in (("", (0, (1, 1))), ("-q", (0, (3, 1, 1, 1))))
}
TRUTH: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": (0, (4, 3)), "zorder": 5}
AXES = ("x", "y", "z")
AXIS_COLOURS = ("#D55E00", "#009E73", "#0072B2")


def angles(solved: tuple[Solved, ...], reference: Reference | None) -> Figure:
    """Roll, pitch and yaw of every estimator, with ±2σ of the first, and the truth."""
    figure, axes = blank(6.6, 3, 1, sharex=True)
    first = solved[0]
    rows = thin(len(first.history))
    t = first.history.seconds[rows]
    sigmas = first.history.roll_pitch_yaw_sigmas()
    for k, (one, label) in enumerate(zip(axes[:, 0], ("roll, °", "pitch, °", "yaw, °"), strict=True)):
        for other in solved[::-1]:
            path = np.degrees(other.history.roll_pitch_yaw()[rows, k])
            width = 1.3 if other is first else 0.9
            one.plot(t, _unjumped(path), label=other.title, linewidth=width, **LOOKS[other.name])
        if sigmas is not None:
            middle, half = np.degrees(first.history.roll_pitch_yaw()[rows, k]), np.degrees(sigmas[rows, k])
            near = np.minimum(2 * half, 180.0)
            one.fill_between(
                t, middle - near, middle + near, alpha=0.2, linewidth=0, color=LOOKS[first.name]["color"],
                label=f"±2σ of {first.title}",
            )  # fmt: skip
        if reference is not None and first.error is not None:
            turned = quaternion_multiply(_about_up(first.error.offset), reference.world_q_body[rows])
            one.plot(t, _unjumped(np.degrees(roll_pitch_yaw(turned)[:, k])), label="truth", **TRUTH)
        one.set_ylabel(label)
    axes[1, 0].set_ylim(-95, 95)
    axes[2, 0].set(ylim=(-185, 185), yticks=range(-180, 181, 90), xlabel="time, s")
    legend_below(figure, axes[2, 0])
    return figure


def biases(solved: tuple[Solved, ...]) -> Figure | None:
    """Gyro bias of the first estimator that has one, with ±2σ."""
    found = next((one for one in solved if one.history.gyro_bias is not None), None)
    if found is None or found.history.gyro_bias is None:
        return None
    history, bias = found.history, found.history.gyro_bias
    figure, axes = blank(2.8)
    one, rows = axes[0, 0], thin(len(history))
    t = history.seconds[rows]
    for k, (axis, colour) in enumerate(zip(AXES, AXIS_COLOURS, strict=True)):
        path = np.degrees(bias[rows, k])
        one.plot(t, path, color=colour, label=f"{axis}, {found.title}")
        if history.gyro_bias_cov is not None:
            half = 2.0 * np.degrees(np.sqrt(history.gyro_bias_cov[rows, k, k]))
            one.fill_between(t, path - half, path + half, color=colour, alpha=0.15, linewidth=0)
    final = np.degrees(bias[len(history) // 4 :])
    reach = 1.6 * max(float(np.abs(final).max()), 0.02)
    one.set(xlabel="time, s", ylabel="gyro bias, °/s", ylim=(-reach, reach))
    legend_below(figure, one)
    return figure


def moments(solved: tuple[Solved, ...], reference: Reference | None) -> Figure | None:
    """When the sensor was held to be at rest, and the field to be disturbed."""
    spans: list[tuple[str, NDArray[np.bool_], str]] = []
    if reference is not None and not reference.where.all():
        spans.append(("motion (truth)", reference.where, "#444444"))
    for one in solved:
        for flags, what in ((one.history.rest, "rest"), (one.history.magnetic_disturbance, "disturbed")):
            if flags is not None:
                spans.append((f"{what}, {one.title}", flags, "#009E73" if what == "rest" else "#D55E00"))
    if not spans:
        return None
    figure, axes = blank(0.8 + 0.3 * len(spans))
    t = solved[0].history.seconds
    for k, (_, flags, colour) in enumerate(spans):
        _bars(axes[0, 0], t, flags, k, colour)
    axes[0, 0].set(xlabel="time, s", yticks=range(len(spans)), yticklabels=[label for label, *_ in spans])
    axes[0, 0].set(xlim=(t[0], t[-1]), ylim=(len(spans) - 0.5, -0.5))
    axes[0, 0].grid(visible=False, axis="y")
    return figure


def errors(solved: tuple[Solved, ...]) -> Figure | None:
    """Heading and inclination errors against the truth, and the 95 % bounds that the first declares."""
    judged = [one for one in solved if one.error is not None]
    if not judged:
        return None
    figure, axes = blank(4.6, 2, 1, sharex=True)
    rows = thin(len(judged[0].history))
    t, bounds = judged[0].history.seconds[rows], _bounds(judged[0], rows)
    for axis, part, label in ((axes[0, 0], 1, "heading error, °"), (axes[1, 0], 2, "inclination error, °")):
        top = 1.0
        for one in judged[::-1]:
            values = np.degrees(one.error.errors[rows, part])  # type: ignore[union-attr]
            axis.plot(t, values, label=one.title, **LOOKS[one.name])
            top = max(top, 1.15 * float(np.nanpercentile(values, 99.5)))
        if bounds is not None:
            look = {"color": LOOKS[judged[0].name]["color"], "alpha": 0.15, "linewidth": 0}
            axis.fill_between(t, 0, bounds[part - 1], label=f"95 % of {judged[0].title}, declared", **look)
        axis.set(ylabel=label, ylim=(0, top))
    axes[1, 0].set_xlabel("time, s")
    legend_below(figure, axes[1, 0])
    return figure


def spread(solved: tuple[Solved, ...]) -> Figure | None:
    """How far the other estimators are from the first, where there is no truth to say which is right."""
    if len(solved) < 2 or solved[0].error is not None:
        return None
    figure, axes = blank(4.0, 2, 1, sharex=True)
    first, rows = solved[0], thin(len(solved[0].history))
    t = first.history.seconds[rows]
    for one in solved[1:]:
        apart = attitude_error(one.history.world_q_body, first.history.world_q_body).errors[rows]
        axes[0, 0].plot(t, np.degrees(apart[:, 1]), label=one.title, **LOOKS[one.name])
        axes[1, 0].plot(t, np.degrees(apart[:, 2]), label=one.title, **LOOKS[one.name])
    axes[0, 0].set_ylabel(f"heading from\n{first.title}, °")
    axes[1, 0].set(ylabel=f"inclination from\n{first.title}, °", xlabel="time, s")
    legend_below(figure, axes[1, 0])
    return figure


def _bounds(one: Solved, rows: NDArray[np.int64]) -> tuple[Array, Array] | None:
    """Heading and inclination (K,), degrees, that 95 % of errors stay below if the covariance is right."""
    if one.history.cov is None:
        return None
    world_R_body = rotation_matrix(one.history.world_q_body[rows])
    cov = world_R_body @ one.history.cov[rows] @ np.swapaxes(world_R_body, 1, 2)
    level = 0.5 * (cov[:, 0, 0] + cov[:, 1, 1])
    return np.degrees(1.96 * np.sqrt(cov[:, 2, 2])), np.degrees(2.448 * np.sqrt(level))


def _unjumped(path: Array) -> Array:
    """Degrees with a break (NaN) where they jump from one end of their range to the other."""
    broken = path.copy()
    broken[1:][np.abs(np.diff(path)) > 270.0] = np.nan
    return broken


def _about_up(angle: float) -> Array:
    return np.array([np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)])


def _bars(axes: Axes, t: Array, flags: NDArray[np.bool_], row: int, colour: str) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    spans = [(t[a], t[min(b, len(t) - 1)] - t[a]) for a, b in edges.reshape(-1, 2)]
    axes.broken_barh(spans, (row - 0.35, 0.7), color=colour, linewidth=0)
