"""Numbers as a table writes them, for the terminal and for the page."""

from __future__ import annotations

from collections.abc import Iterable
from math import floor, isfinite, log10
from textwrap import wrap

from factorlab.compare.estimators import KINDS
from factorlab.compare.table import Comparison, Row, Tuned
from factorlab.compare.verdict import Finding

__all__ = ["band", "cells", "figure", "headings", "headline", "terminal", "tuning_lines", "verdict_lines"]

NOTHING = "–"
WIDTH = 110
PAGE_ONLY = {7, 8, 11}  # columns that a terminal has no room for: band and median of the NIS, iterations


def figure(value: float | None, digits: int = 3) -> str:
    """A number with `digits` significant digits, without an exponent where it reads well without."""
    if value is None or not isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    size = abs(value)
    if 1e-3 <= size < 1e5:
        text = f"{size:.{max(digits - 1 - floor(log10(size)), 0)}f}"
    else:
        text = f"{size:.{digits - 1}e}"
    return f"−{text}" if value < 0 else text


def plain(value: float) -> str:
    """A number that is a whole one, or a rounded constant: `3`, `2.37`."""
    return f"{value:.3g}"


def band(limits: tuple[float, float] | None) -> str:
    """`2.5 – 3.5`, `−0.2 to 0.2`, or nothing."""
    if limits is None:
        return ""
    between = " to " if limits[0] < 0 else " – "
    return between.join(map(figure, limits))


def headline(comparison: Comparison) -> str:
    """One sentence: how far off a filter is, how far off a smoother, before and after tuning."""
    rows = [row for row in comparison.rows if row.rmse is not None]
    filters = [row for row in rows if KINDS[row.name].online]
    smoothers = [row for row in rows if not KINDS[row.name].online]
    if not filters or not smoothers:
        return ""
    first, best = filters[0], min(smoothers, key=lambda row: row.rmse or 0.0)
    errors = best.errors
    unit = " m" if errors is not None and errors.metres else ""
    what = "against the truth" if errors is not None and errors.against == "truth" else "on held-out readings"
    told = [f"{row.title} {figure(row.rmse)}{unit}{_before(comparison, row, unit)}" for row in (first, best)]
    times = figure((first.rmse or 0.0) / (best.rmse or 1.0), 2)
    return f"RMSE {what}: {told[0]}, {told[1]}. Here the later readings are worth a factor of {times}."


def _before(comparison: Comparison, row: Row, unit: str) -> str:
    earlier = next((old for old in comparison.untuned if old.name == row.name), None)
    return "" if earlier is None or earlier.rmse is None else f" (before tuning {figure(earlier.rmse)}{unit})"


def headings(comparison: Comparison) -> tuple[tuple[str, str], ...]:
    """Heading and unit (or what is expected) of each column."""
    first = next((row for row in comparison.rows if row.errors is not None), None)
    errors = None if first is None else first.errors
    against = {"held-out": "held-out RMSE", "truth": "RMSE to truth"}.get(
        errors.against if errors else "", "RMSE"
    )
    honest = None if first is None else first.normalised_error
    innovations = next((row.nis for row in comparison.rows if row.nis is not None), None)
    return (
        ("estimator", ""),
        (against, "m" if errors is None or errors.metres else "sensor's unit"),
        ("norm. error", f"{plain(honest.expected)} exp." if honest else ""),
        ("median", f"{plain(honest.median_expected)} exp." if honest else ""),
        ("band per gap" if errors and errors.against == "held-out" else "band per block", "95 %"),
        ("tail", "5 % exp."),
        ("NIS", f"{plain(innovations.expected)} exp." if innovations else ""),
        ("its band", "95 %"),
        ("median", ""),
        ("per reading", "µs"),
        ("total", "s"),
        ("iter.", ""),
    )


def cells(row: Row) -> tuple[str, ...]:
    """One string for each of `headings`; the NIS of a smoother is marked ° for leave-one-out."""
    honest, nis = row.normalised_error, row.nis
    mark = "°" if nis is not None and nis.kind != "filter" else ""
    return (
        row.title,
        figure(row.rmse, 4),
        figure(honest.mean) if honest else NOTHING,
        figure(honest.median) if honest else NOTHING,
        (band(honest.bootstrap_band95) if honest else "") or NOTHING,
        f"{100 * honest.tail_share:.0f} %" if honest else NOTHING,
        f"{figure(nis.mean)}{mark}" if nis else NOTHING,
        band(nis.band95) if nis else NOTHING,
        figure(nis.median) if nis else NOTHING,
        figure(row.us_per_measurement),
        figure(row.seconds),
        NOTHING if row.iterations is None else str(row.iterations),
    )


def tuning_lines(tuned: Tuned) -> tuple[tuple[str, str, str, str, str], ...]:
    """Knob, before, after, factor, interval."""
    lines = []
    for name, value in tuned.values.items():
        before, unit = tuned.initial[name], tuned.units.get(name, "")
        interval = band(tuned.intervals.get(name)) or NOTHING
        ratio = f"×{figure(value / before)}" if before else NOTHING
        lines.append(
            (name, f"{figure(before)} {unit}".strip(), f"{figure(value)} {unit}".strip(), ratio, interval)
        )
    return tuple(lines)


def terminal(comparison: Comparison) -> Iterable[str]:
    """The verdict, then the table (before and after, when tuned), line by line."""
    yield comparison.dataset.title
    yield ""
    if told := headline(comparison):
        yield from wrap(told, WIDTH)
        yield ""
    yield from verdict_lines(comparison.findings)
    if comparison.tuned is not None:
        yield from _table(comparison, comparison.untuned, "noise as shipped")
        yield from _tuning(comparison.tuned)
        yield from _table(comparison, comparison.rows, "noise tuned on the readings in use")
    else:
        yield from _table(comparison, comparison.rows, "")
    if any(row.nis is not None and row.nis.kind != "filter" for row in comparison.rows):
        yield "° leave-one-out: each reading predicted from all the others, before and after"
    from factorlab.compare.smoothing_text import smoothing_lines

    yield from smoothing_lines(comparison)
    yield from (f"- {note}" for note in comparison.dataset.notes)


def verdict_lines(findings: tuple[Finding, ...]) -> Iterable[str]:
    """Each finding with its value, what it means and what to do."""
    for finding in findings:
        limits = f"  [{band(finding.band95)}]" if finding.band95 else ""
        value = f"  {figure(finding.value)}{limits}" if finding.value is not None else ""
        yield f"{finding.status}  {finding.metric}{value}"
        yield from wrap(finding.meaning, WIDTH, initial_indent="      ", subsequent_indent="      ")
        if finding.action:
            yield from wrap(
                f"-> {finding.action}", WIDTH, initial_indent="      ", subsequent_indent="         "
            )
    if findings:
        yield ""


def aligned(lines: list[tuple[str, ...]]) -> Iterable[str]:
    """Lines of cells as columns: the first stands left, the others right."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        first, *rest = (
            cell.ljust(w) if k == 0 else cell.rjust(w)
            for k, (cell, w) in enumerate(zip(line, widths, strict=True))
        )
        yield "  ".join((first, *rest)).rstrip()


def _table(comparison: Comparison, rows: tuple[Row, ...], title: str) -> Iterable[str]:
    body = [cells(row) for row in rows if not row.failed]
    whole = [*zip(*headings(comparison), strict=True), *body]
    lines = [tuple(cell for k, cell in enumerate(line) if k not in PAGE_ONLY) for line in whole]
    if title:
        yield f"{title}:"
    yield from aligned(lines)
    for row in rows:
        if row.failed or row.message:
            yield f"{row.title}: {row.message}"
    yield ""


def _tuning(tuned: Tuned) -> Iterable[str]:
    yield f"tuned in {figure(tuned.seconds, 2)} s, {tuned.evaluations} evaluations of the likelihood:"
    lines = tuning_lines(tuned)
    widths = [max(len(line[k]) for line in lines) for k in range(4)]
    for name, before, after, ratio, interval in lines:
        arrow = f"  {name.ljust(widths[0])}  {before.rjust(widths[1])} -> {after.rjust(widths[2])}"
        yield f"{arrow}  {ratio.rjust(widths[3])}" + (f"  [{interval}]" if interval != NOTHING else "")
    if tuned.message:
        yield f"  {tuned.message}"
    yield ""
