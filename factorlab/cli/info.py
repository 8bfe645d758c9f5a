"""`factorlab info`: what a log holds, and what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import as_json, print_json

if TYPE_CHECKING:
    from sequential.log import SensorLog, Stream

__all__ = ["info"]

GAP_FACTOR = 5.0  # a pause of more than this many median intervals is worth a line


@click.command(short_help="What a log holds: streams, rates, gaps, order.")
@click.argument("source", metavar="DATASET|LOG")
@as_json
@in_one_sentence
def info(source: str, as_json: bool) -> int:
    """List the streams of a CSV or NPZ log (or of a dataset) with counts, rates, gaps and disorder."""
    logs = _logs(source)
    found = {log.name: {name: _summary(stream) for name, stream in log.items()} for log in logs}
    if as_json:
        print_json({"schema": 1, "logs": found})
        return 0
    for log in logs:
        click.echo(log.name)
        for line in _table(found[log.name]):
            click.echo(f"  {line}")
    return 0


def _logs(source: str) -> list[SensorLog]:
    from factorlab.compare.own import require_log
    from factorlab.datasets import NAMES, load
    from sequential.readers import read_log

    if source in NAMES:
        return [dataset.log for dataset in load(source, use_every=1)]
    return [read_log(require_log(source, NAMES), check=False)]


def _summary(stream: Stream) -> dict[str, Any]:
    import numpy as np

    steps = np.diff(stream.t) * 1e-9
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if len(forward) else None
    gaps = np.flatnonzero(steps > GAP_FACTOR * usual) if usual else np.zeros(0, dtype=int)
    return {
        "readings": len(stream),
        "columns": stream.values.shape[1],
        "context_columns": 0 if stream.context is None else stream.context.shape[1],
        "covers": stream.covers,
        "start_s": float(stream.t[0]) * 1e-9 if len(stream) else None,
        "end_s": float(stream.t[-1]) * 1e-9 if len(stream) else None,
        "rate_hz": 1.0 / usual if usual else None,
        "gaps": len(gaps),
        "longest_gap_s": float(steps.max()) if len(steps) else None,
        "backwards": int((steps < 0).sum()),
        "repeated": int(stream.repeated().sum()),
        "not_finite": int((~np.isfinite(stream.values).all(axis=1)).sum()),
    }


def _table(streams: dict[str, dict[str, Any]]) -> list[str]:
    head = ("stream", "readings", "columns", "rate, Hz", "from, s", "to, s", "longest pause, s", "to mend")
    rows = [head, *(_line(name, found) for name, found in streams.items())]
    widths = [max(len(row[k]) for row in rows) for k in range(len(head))]
    return ["  ".join(map(_pad, row, widths, range(len(head)))).rstrip() for row in rows]


def _line(name: str, found: dict[str, Any]) -> tuple[str, ...]:
    faults = (
        ("gaps", "gaps"),
        ("backwards", "backwards"),
        ("repeated", "repeated"),
        ("not_finite", "not finite"),
    )
    told = ", ".join(f"{found[key]} {what}" for key, what in faults if found[key])
    rate = "–" if found["rate_hz"] is None else f"{found['rate_hz']:.6g}"
    times = (
        "–" if found[key] is None else f"{found[key]:.3f}" for key in ("start_s", "end_s", "longest_gap_s")
    )
    return (name, str(found["readings"]), str(found["columns"]), rate, *times, told or "–")


def _pad(cell: str, width: int, column: int) -> str:
    """Words to the left, numbers to the right."""
    return cell.ljust(width) if column in {0, 7} else cell.rjust(width)
