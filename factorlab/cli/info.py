"""`factorlab info`: what a log or a recording holds, and what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import recording_options
from factorlab.cli.settings import as_json, print_json

if TYPE_CHECKING:
    from sequential.log import SensorLog, Stream

__all__ = ["info"]

GAP_FACTOR = 5.0  # a pause of more than this many median intervals is worth a line


@click.command(short_help="What a log or an IMU recording holds, and what is wrong with it.")
@click.argument("source", metavar="DATASET|LOG|RECORDING")
@recording_options
@as_json
@in_one_sentence
def info(source: str, as_json: bool, **options: Any) -> int:
    """List the streams of a CSV or NPZ log (or of a dataset) with counts, rates, gaps and disorder.

    Of a recording of an IMU (a file, the folder or zip of a phone's export, or a name such as broad:07), say
    its health as well: saturated or stuck axes, units that contradict gravity, pauses, and so on.
    """
    if any(options.values()) or _is_recording(source):
        return _tell_recording(source, as_json, options)
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


def _is_recording(source: str) -> bool:
    """Whether a name or a file is a recording of an IMU rather than a log of streams."""
    from pathlib import Path

    from factorlab.datasets.recordings import RECORDINGS
    from sequential.readers.imu import holds_imu

    path = Path(source)
    if path.exists():
        return holds_imu(path)
    return ":" in source or source in RECORDINGS


def _tell_recording(source: str, as_json: bool, options: dict[str, Any]) -> int:
    import numpy as np

    from factorlab.datasets.recordings import open_recording
    from sequential.sensors.health import inspect

    recording, truth, path = open_recording(source, **options)
    findings = inspect(recording)
    streams = {name: _summary(stream) for name, stream in recording.to_log().items()}
    units = {sensor: getattr(recording, f"{sensor}_unit") for sensor in recording.sensors}
    seen = None if truth is None else int(np.isfinite(truth.world_q_body[:, 0]).sum())
    if as_json:
        told = [{k: getattr(f, k) for k in ("severity", "what", "where", "do")} for f in findings]
        about = {"samples": len(recording), "rate_hz": recording.rate, "duration_s": recording.duration}
        found = {"file": str(path), **about, "units": units, "with_truth": seen, "findings": told}
        print_json({"schema": 1, "logs": {recording.name: streams}, "recordings": {recording.name: found}})
        return 0
    click.echo(f"{recording.name}: {recording.duration:.2f} s at {recording.rate:.5g} Hz ({path})")
    click.echo("  " + ", ".join(f"{sensor} in {unit}" for sensor, unit in units.items()))
    if seen is not None:
        click.echo(f"  with the true attitude of {seen} of {len(recording)} samples")
    for line in [*_table(streams), *(f"{finding.severity}: {finding}" for finding in findings)]:
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
