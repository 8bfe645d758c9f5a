"""Errors of each axis, windows of several lengths, and what smoothing bought, as text."""

from __future__ import annotations

from collections.abc import Iterable
from math import degrees
from textwrap import wrap

from factorlab.compare.axes import AxisErrors
from factorlab.compare.bought import sentences
from factorlab.compare.table import Comparison
from factorlab.compare.text import NOTHING, WIDTH, figure

__all__ = ["axis_table", "lag_table", "small", "smoothing_lines", "unit_of"]


def axis_table(comparison: Comparison) -> tuple[tuple[str, ...], ...]:
    """Share of errors within ±3σ and RMSE of each axis, headings first; empty where there is no turn.

    Estimators, then the delayed estimates of windows of several lengths.
    """
    told: list[tuple[str, AxisErrors]] = [
        (row.title, row.axes) for row in comparison.rows if row.axes is not None
    ]
    told += [
        (f"{lag.lag_s:g} s later", lag.axes) for lag in comparison.lags if lag.axes is not None and lag.lag_s
    ]
    if not told or not told[0][1].turns:
        return ()
    lines = [("inside ±3σ (99.7 % exp.), RMSE", *told[0][1].names)]
    for title, axes in told:
        cells = zip(axes.inside(), axes.rmse(), axes.units, strict=True)
        lines.append((title, *(f"{100 * share:.1f} %, {small(rmse, unit)}" for share, rmse, unit in cells)))
    return tuple(lines)


def small(rmse: float, unit: str) -> str:
    """`21.3 mm`, `0.84°`, or metres where they are many."""
    if unit == "rad":
        return f"{figure(degrees(rmse))}°"
    return f"{figure(1e3 * rmse)} mm" if rmse < 1.0 else f"{figure(rmse)} m"


def unit_of(comparison: Comparison) -> str:
    """Of errors: "m", or "sensor's unit"."""
    first = next((row.errors for row in comparison.rows if row.errors is not None), None)
    return "m" if first is None or first.metres else "sensor's unit"


def lag_table(comparison: Comparison) -> tuple[tuple[str, ...], ...]:
    """A line for each window, headings first; empty where none was tried."""
    if not comparison.lags:
        return ()
    unit = unit_of(comparison)
    lines: list[tuple[str, ...]] = [
        (
            "window", f"RMSE, {unit}", "norm. error (1 exp.)", f"newest: RMSE, {unit}", "norm. error",
            "µs a reading", "slowest update, ms", "states kept", "kB",
        )
    ]  # fmt: skip
    for lag in comparison.lags:
        if lag.message:
            lines.append((f"{lag.lag_s:g} s", lag.message, *[""] * 7))
            continue
        told = (
            lag.rmse, lag.anees_per_dof, lag.online_rmse, lag.online_anees_per_dof,
            lag.us_per_measurement, lag.slowest_update_ms,
        )  # fmt: skip
        kept = NOTHING if lag.states_kept is None else str(lag.states_kept)
        lines.append((f"{lag.lag_s:g} s", *map(figure, told), kept, figure(lag.memory_kb)))
    return tuple(lines)


def smoothing_lines(comparison: Comparison) -> Iterable[str]:
    """All of it for a terminal."""
    yield from _aligned(axis_table(comparison))
    if comparison.lags:
        yield "what waiting is worth: estimates `window` seconds late, beside the newest of the same window"
        yield from _aligned(lag_table(comparison))
    if comparison.bought is None:
        return
    yield "what smoothing bought:"
    for told in (*sentences(comparison.bought, unit_of(comparison)), *comparison.bought.why):
        yield from wrap(told, WIDTH, initial_indent="- ", subsequent_indent="  ")
    yield ""


def _aligned(table: tuple[tuple[str, ...], ...]) -> Iterable[str]:
    if not table:
        return
    wide = [max(map(len, column)) for column in zip(*table, strict=True)]
    for line in table:
        cells = (
            c.ljust(w) if k == 0 else c.rjust(w) for k, (c, w) in enumerate(zip(line, wide, strict=True))
        )
        yield "  ".join(cells).rstrip()
    yield ""
