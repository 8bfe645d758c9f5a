"""The page of a calibration: verdicts, constants, dwells, moves, coverage; and the files beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factorlab.calibration.job import Calibrated
from factorlab.calibration.numbers import numbers_of
from factorlab.calibration.parameters import Parameter, parameters_of
from factorlab.calibration.verdicts import verdicts_of
from factorlab.report.document import Document, Section, Table
from sequential.sensors import best_next_direction, c_header, kalibr_yaml

__all__ = ["calibration_document", "export_files", "up_of"]

EQUATION = "calibrated = matrix · (raw − offset), in the axes of the chip."
CONSTANTS = (
    "calibrated = matrix · (raw − offset). The frame's x axis is the accelerometer's own, its y axis lies in "
    "the plane of the accelerometer's x and y; gravity alone cannot show how the case lies in that frame."
)
CONSTANTS_READ = "Difference from nominal with 95 % intervals; one that spans the dashed line is no news."
DWELLS_READ = "|mean| − g of every dwell: nominal constants, fitted ones, and fitted without that dwell."
COVERAGE_READ = "Which way is up in the sensor's frame, on both halves of the sphere; the cross comes next."
MOVES_READ = "Angle between gravity as the gyro carries it over a move and as the accelerometer reads it."
TIMELINE_READ = "Still parts are shaded, those left out are hatched. Below: what tells still from moving."
TRIAL_READ = "|mean| − g of every dwell of a recording that the constants were not made from."


def calibration_document(done: Calibrated, title: str, command: str = "") -> Document:
    """Everything about a calibration, for the screen, `--json` and the page."""
    parameters = parameters_of(done)
    one = done.recording
    count = len(done.dwells)
    lead = (
        f"{one.name}: {one.duration:.0f} s at {one.rate:.0f} Hz, {count} still part{'s' * (count != 1)}; "
        f"|g| = {done.gravity:.5f} m/s²."
    )
    numbers = numbers_of(done, parameters)
    sections = tuple(_sections(done, parameters))
    return Document(title, lead, verdicts_of(done), sections, numbers, command=command)


def export_files(done: Calibrated, command: str = "") -> dict[str, str]:
    """calibration.json, calibration.h and Kalibr's IMU file."""
    bundle = done.calibration
    source = f"{done.recording.name}{f', {command}' if command else ''}"
    return {
        "calibration.json": bundle.to_json() + "\n",
        "calibration.h": c_header(bundle, source=source),
        "kalibr_imu.yaml": kalibr_yaml(bundle, rate=done.recording.rate),
    }


def up_of(done: Calibrated) -> NDArray[np.float64]:
    """Which way is up (K, 3) in the sensor's calibrated frame, dwell by dwell."""
    assert done.accel is not None  # noqa: S101 - the caller has looked
    assert done.dwells.accel is not None  # noqa: S101
    up = done.accel.calibration.apply(done.dwells.accel)
    return np.asarray(up / np.linalg.norm(up, axis=1)[:, None])


def _sections(done: Calibrated, parameters: tuple[Parameter, ...]) -> list[Section]:
    from factorlab.report import calibration_figures as figures

    table = _constants(parameters)
    words = CONSTANTS if done.accel is not None else EQUATION
    found = [Section("Constants", words, table, lambda: figures.intervals(parameters), CONSTANTS_READ)]
    if done.accel is not None:
        following = best_next_direction(up_of(done))[1]
        next_one = f"The most useful next position, farthest from all so far: {following}."
        found += [
            Section("Dwells", "", _dwells(done), lambda: figures.dwell_residuals(done), DWELLS_READ),
            Section("Coverage", next_one, None, lambda: figures.coverage(done, up_of(done)), COVERAGE_READ),
        ]
    if done.gyro is not None:
        found.append(Section("Moves", "", _moves(done), lambda: figures.move_residuals(done), MOVES_READ))
    if done.turns is not None:
        found.append(Section("Turns", "", _turns(done)))
    found.append(Section("Timeline", "", None, lambda: figures.timeline(done), TIMELINE_READ))
    if (trial := done.verification) is not None and trial.after is not None:
        title = f"Tried on {trial.name}"
        found.append(Section(title, "", None, lambda: figures.verification(done), TRIAL_READ))
    return found


def _constants(parameters: tuple[Parameter, ...]) -> Table:
    rows = []
    for p in parameters:
        low, high = (None, None) if p.interval is None else p.interval
        rows.append((p.sensor, p.name, p.value, low, high, p.unit, "" if p.observed else "not seen"))
    headings = ("sensor", "constant", "value", "95 % from", "to", "unit", "")
    return Table(headings, tuple(rows), digits=5)


def _dwells(done: Calibrated) -> Table:
    fit = done.accel
    assert fit is not None  # noqa: S101 - the caller has looked
    small = (1e3 * fit.after, 1e3 * fit.left_out)
    columns = np.stack([*done.dwells.seconds.T, fit.before, *small], axis=1).round(4).tolist()
    used = ["yes" if one else "no" for one in fit.used]
    rows = tuple((k + 1, *row, used[k]) for k, row in enumerate(columns))
    units = (("from", "s"), ("to", "s"), ("before", "m/s²"), ("after", "mm/s²"), ("left out", "mm/s²"))
    return Table(("dwell", *units, "used"), rows, digits=4)


def _moves(done: Calibrated) -> Table:
    fit = done.gyro
    assert fit is not None  # noqa: S101 - the caller has looked
    angles = np.degrees([fit.before, fit.after, fit.left_out])
    columns = np.stack([*fit.seconds.T, *angles], axis=1).round(4).tolist()
    words = np.where(fit.whole, np.where(fit.used, "yes", "no"), "range or gap").tolist()
    rows = tuple((k + 1, *row, words[k]) for k, row in enumerate(columns))
    units = (("from", "s"), ("to", "s"), ("before", "°"), ("after", "°"), ("left out", "°"))
    return Table(("move", *units, "used"), rows, digits=4)


def _turns(done: Calibrated) -> Table:
    fit = done.turns
    assert fit is not None  # noqa: S101 - the caller has looked
    given = np.array([turn.angle for turn in fit.turns])
    angles = np.degrees([given, fit.before, fit.after])
    columns = np.stack([*fit.seconds.T, *angles], axis=1).tolist()
    rows = tuple((k + 1, "xyz"[fit.turns[k].axis], *row) for k, row in enumerate(columns))
    units = (("from", "s"), ("to", "s"), ("given", "°"), ("nominal gain", "°"), ("fitted gain", "°"))
    return Table(("turn", "axis", *units), rows, digits=5)
