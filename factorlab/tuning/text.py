"""A tuning as a terminal shows it, and as one JSON document."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from textwrap import wrap
from typing import Any

from factorlab.compare.table import SCHEMA, strict
from factorlab.compare.text import NOTHING, WIDTH, figure, verdict_lines
from factorlab.tuning.engine import Fitted
from factorlab.versions import versions
from sequential.tuning import Tuning

__all__ = ["fitted_document", "fitted_lines"]

METHOD = {
    "ml": "maximum likelihood of the innovations",
    "nis": "process noise by the NIS",
    "em": "expectation-maximisation",
    "als": "autocovariance least squares",
    "still": "noise at rest",
}
HEAD = ("knob", "before", "after", "factor", "95 % interval", "unit")


def fitted_lines(fitted: Fitted) -> Iterable[str]:
    """Table, verdict before and after, findings, and what to write into the model, line by line."""
    found = fitted.tuning
    yield fitted.title
    passes = (
        f", {found.evaluations} filter passes in {figure(found.seconds, 2)} s" if found.evaluations else ""
    )
    yield f"{METHOD[found.method]}{passes}"
    yield ""
    yield from _table(found)
    for note in found.notes:
        yield from wrap(f"- {note}", WIDTH, subsequent_indent="  ")
    yield ""
    for when, verdict in (("before", found.before), ("after", found.after)):
        if verdict is not None:
            yield from wrap(f"{when}: {verdict.sentence}", WIDTH, subsequent_indent="        ")
    if isfinite(found.log_likelihood_before):
        first, last = found.log_likelihood_before, found.log_likelihood_after
        yield f"log likelihood {first:.1f} -> {last:.1f} ({last - first:+.1f})"
    yield ""
    yield from verdict_lines(fitted.findings)
    if fitted.write:
        yield "write into the model:"
        yield from (f"  {line}" for line in fitted.write)


def _table(found: Tuning) -> Iterable[str]:
    rows = [HEAD, *(_row(found, name) for name in found.values)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(HEAD))]
    for row in rows:
        cells = [
            cell.ljust(w) if k in {0, 5} else cell.rjust(w)
            for k, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  ".join(cells).rstrip()


def _row(found: Tuning, name: str) -> tuple[str, ...]:
    factor = found.factor(name)
    return (
        name,
        figure(found.initial.get(name)),
        figure(found.values[name]),
        f"×{figure(factor)}" if isfinite(factor) else NOTHING,
        _interval(found, name),
        found.units.get(name, ""),
    )


def _interval(found: Tuning, name: str) -> str:
    low, high = found.interval(name)
    if low == high == found.initial.get(name):
        return "held"
    if low == 0.0 and not isfinite(high):
        return "open"
    if low == 0.0:
        return f"below {figure(high)}"
    if high == float("inf"):
        return f"above {figure(low)}"
    return f"{figure(low)} – {figure(high)}" if isfinite(high - low) else NOTHING


def fitted_document(done: tuple[Fitted, ...], command: str) -> dict[str, Any]:
    """One document for one tuning, or `{"runs": {name: …}}` for several; NaN and infinity become null."""
    whole: dict[str, Any] = {"schema": SCHEMA}
    if len(done) == 1:
        whole |= _plain(done[0])
    else:
        whole["runs"] = {one.name: _plain(one) for one in done}
    whole |= {"versions": versions(), "command": command}
    return {key: strict(value) for key, value in whole.items()}


def _plain(one: Fitted) -> dict[str, Any]:
    return {
        "dataset": one.name,
        "title": one.title,
        **one.tuning.to_json(),
        "findings": [finding.to_json() for finding in one.findings],
        "write": list(one.write),
    }
