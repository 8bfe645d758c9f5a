"""The page of a calibration: verdicts, constants with intervals, dwells, moves, coverage, and the files beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from factorlab.calibration.job import Calibrated
from factorlab.calibration.parameters import Parameter, parameters_of
from factorlab.report.document import Document, Section, Status, Table, Verdict
from sequential.sensors import best_next_direction, c_header, kalibr_yaml
from sequential.sensors.positions import up_directions

if TYPE_CHECKING:
    from sequential.sensors import Verification

__all__ = ["calibration_document", "export_files"]

# |mean| - g of a dwell that was left out, and angle by which gravity arrives: good, and still of use
GOOD_G, FAIR_G = 0.02, 0.1  # m/s²
GOOD_ANGLE, FAIR_ANGLE = np.radians(0.5), np.radians(2.0)
STATUS: dict[str, Status] = {"note": "INFO", "warn": "WARN", "fail": "FAIL"}


def calibration_document(done: Calibrated, title: str, command: str = "") -> Document:
    """Everything about a calibration, for the screen, `--json` and the page."""
    parameters = parameters_of(done)
    lead = (
        f"{done.recording.name}: {done.recording.duration:.0f} s at {done.recording.rate:.0f} Hz, "
        f"{len(done.dwells)} dwells; |g| = {done.gravity:.5f} m/s²."
    )
    return Document(
        title, lead, tuple(_verdicts(done)), tuple(_sections(done, parameters)), _numbers(done, parameters),
        command=command,
    )  # fmt: skip


def export_files(done: Calibrated, command: str = "") -> dict[str, str]:
    """calibration.json, calibration.h and, where Kalibr has a place for it, imu.yaml."""
    bundle = done.calibration
    source = f"{done.recording.name}{f', {command}' if command else ''}"
    return {
        "calibration.json": bundle.to_json() + "\n",
        "calibration.h": c_header(bundle, source=source),
        "kalibr_imu.yaml": kalibr_yaml(bundle, rate=done.recording.rate),
    }


def _verdicts(done: Calibrated) -> list[Verdict]:
    found: list[Verdict] = []
    if done.accel is not None:
        before = float(np.sqrt(np.mean(done.accel.before**2)))
        rms = done.accel.leave_one_out_rms
        found.append(
            Verdict(
                "|mean of a left-out dwell| - g, RMS",
                rms,
                None,
                _judged(rms, GOOD_G, FAIR_G),
                f"a position that the fit has not seen reads g to {100 * rms / done.gravity:.2g} %; "
                f"{before:.3g} m/s² before",
                "" if rms <= GOOD_G else "hold every position stiller, add positions",
                "m/s²",
            )  # fmt: skip
        )
    if done.gyro is not None:
        angle = done.gyro.leave_one_out_rms
        before = float(np.sqrt(np.mean(done.gyro.before[done.gyro.used & done.gyro.whole] ** 2)))
        found.append(
            Verdict(
                "gravity carried over a left-out move, RMS",
                float(np.degrees(angle)),
                None,
                _judged(angle, GOOD_ANGLE, FAIR_ANGLE),
                f"the gyro turns as the accelerometer sees it to that angle; {np.degrees(before):.2g}° before",
                "" if angle <= GOOD_ANGLE else "move more slowly, rest longer in between",
                "°",
            )  # fmt: skip
        )
    if done.turns is not None:
        off = float(np.degrees(np.sqrt(np.mean((done.turns.after - _known(done)) ** 2))))
        found.append(
            Verdict("known turns, RMS of what is left", off, None, _judged(off, 0.5, 2.0),
                    "of the angles as given", "", "°")
        )  # fmt: skip
    found += [
        Verdict(finding.what, finding.where or None, None, STATUS[finding.severity], "", finding.do)
        for finding in done.findings
    ]
    if done.verification is not None:
        found += _verified(done.verification)
    return found


def _verified(trial: Verification) -> list[Verdict]:
    found: list[Verdict] = []
    if trial.rms is not None:
        before = "" if trial.before is None else f"{np.sqrt(np.mean(trial.before**2)):.3g} m/s² before; "
        found.append(
            Verdict(f"|mean| - g on {trial.name}, RMS", trial.rms, None, _judged(trial.rms, 2 * GOOD_G, FAIR_G),
                    f"{before}{len(trial.dwells)} dwells of another recording", "", "m/s²")
        )  # fmt: skip
    for move in trial.moves:
        found.append(
            Verdict(
                f"turn at {move.seconds[0]:.0f} s of {trial.name}, gravity off",
                float(np.degrees(move.off)),
                None,
                _judged(move.off, GOOD_ANGLE, FAIR_ANGLE),
                f"gravity turns by {np.degrees(move.by_gyro):.2f}° by the gyro, by {np.degrees(move.by_gravity):.2f}° "
                "by the accelerometer",
                "",
                "°",
            )  # fmt: skip
        )
    if trial.bias_change is not None:
        size = float(np.degrees(np.abs(trial.bias_change).max()))
        found.append(
            Verdict(f"gyro's bias on {trial.name}, largest change", size, None, "INFO",
                    "from one switching-on to the next; it is not in the constants", "", "°/s")
        )  # fmt: skip
    return found


def _judged(value: float, good: float, fair: float) -> Status:
    return "PASS" if value <= good else "WARN" if value <= fair else "FAIL"


def _known(done: Calibrated) -> Any:
    assert done.turns is not None  # noqa: S101 - the caller has looked
    return np.array([turn.angle for turn in done.turns.turns])


def _sections(done: Calibrated, parameters: tuple[Parameter, ...]) -> list[Section]:
    from factorlab.report import calibration_figures as figures

    found = [
        Section(
            "Constants",
            "calibrated = matrix · (raw − offset). The frame's x axis is the accelerometer's, its y axis lies in "
            "the plane of the accelerometer's x and y. A bar that reaches across the dashed line says nothing.",
            _constants(parameters),
            lambda: figures.intervals(parameters),
            "Difference from nominal with 95 % intervals.",
        )
    ]
    if done.accel is not None:
        found.append(
            Section(
                "Dwells",
                "",
                _dwells(done),
                lambda: figures.dwell_residuals(done),
                "|mean| − g of every dwell: nominal constants, fitted ones, and fitted without the dwell.",
            )
        )
        up = up_directions(done.accel.calibration.apply(done.dwells.accel), si=True)  # type: ignore[arg-type]
        _, words = best_next_direction(up)
        found.append(
            Section(
                "Coverage",
                f"Farthest from all positions so far, and the most useful next one: {words}.",
                None,
                lambda: figures.coverage(done),
                "Which way is up in the sensor's frame, both halves of the sphere; the cross is the next position.",
            )
        )
    if done.gyro is not None:
        found.append(
            Section(
                "Moves",
                "",
                _moves(done),
                lambda: figures.move_residuals(done),
                "Angle between gravity as the gyro carries it over a move and as the accelerometer reads it.",
            )
        )
    caption = "Readings; still parts that were used are shaded, those left out are hatched."
    found.append(Section("Timeline", "", None, lambda: figures.timeline(done), caption))
    if done.verification is not None and done.verification.after is not None:
        found.append(
            Section(
                f"Tried on {done.verification.name}",
                "",
                None,
                lambda: figures.verification(done),
                "|mean| − g of every dwell of a recording that the constants were not made from.",
            )
        )
    return found


def _constants(parameters: tuple[Parameter, ...]) -> Table:
    rows = tuple(
        (
            p.sensor,
            p.name,
            p.value,
            None if p.interval is None else p.interval[0],
            None if p.interval is None else p.interval[1],
            p.unit,
            "" if p.observed else "not seen",
        )
        for p in parameters
    )
    return Table(("sensor", "constant", "value", "from", "to", "unit", ""), rows, digits=5)


def _dwells(done: Calibrated) -> Table:
    fit, dwells = done.accel, done.dwells
    assert fit is not None  # noqa: S101 - the caller has looked
    rows = tuple(
        (
            k + 1,
            float(a),
            float(b),
            float(fit.before[k]),
            float(fit.after[k]),
            float(fit.left_out[k]),
            _yes(fit.used[k]),
        )
        for k, (a, b) in enumerate(dwells.seconds)
    )
    headings = (
        "dwell",
        ("from", "s"),
        ("to", "s"),
        ("before", "m/s²"),
        ("after", "m/s²"),
        ("left out", "m/s²"),
        "used",
    )
    return Table(headings, rows, digits=4)


def _moves(done: Calibrated) -> Table:
    fit = done.gyro
    assert fit is not None  # noqa: S101 - the caller has looked
    rows = tuple(
        (
            k + 1,
            float(a),
            float(b),
            *(float(np.degrees(value[k])) for value in (fit.before, fit.after, fit.left_out)),
            _yes(fit.used[k]) if fit.whole[k] else "range reached",
        )
        for k, (a, b) in enumerate(fit.seconds)
    )
    headings = (
        "move",
        ("from", "s"),
        ("to", "s"),
        ("before", "°"),
        ("after", "°"),
        ("left out", "°"),
        "used",
    )
    return Table(headings, rows, digits=4)


def _yes(value: Any) -> str:
    return "yes" if value else "no"


def _numbers(done: Calibrated, parameters: tuple[Parameter, ...]) -> dict[str, Any]:
    import json

    found: dict[str, Any] = {
        "gravity": done.gravity,
        "parameters": [one.to_json() for one in parameters],
        "calibration": json.loads(done.calibration.to_json()),
    }
    if done.accel is not None:
        a = done.accel
        found["accel"] = {
            "leave_one_out_rms": a.leave_one_out_rms,
            "scatter": a.fit.scatter,
            "freedom": a.fit.freedom,
            **{name: getattr(a, name).tolist() for name in ("before", "after", "left_out", "used")},
            "seconds": done.dwells.seconds.tolist(),
        }
    if done.gyro is not None:
        g = done.gyro
        found["gyro"] = {
            "leave_one_out_rms": g.leave_one_out_rms,
            **{
                name: getattr(g, name).tolist()
                for name in ("before", "after", "left_out", "used", "whole", "seconds")
            },
        }
    if done.turns is not None:
        t = done.turns
        found["turns"] = {
            "given": _known(done).tolist(),
            "before": t.before.tolist(),
            "after": t.after.tolist(),
        }
    if (v := done.verification) is not None:
        found["verification"] = {
            "name": v.name,
            "rms": v.rms,
            "before": None if v.before is None else v.before.tolist(),
            "after": None if v.after is None else v.after.tolist(),
            "bias_change": None if v.bias_change is None else v.bias_change.tolist(),
            "moves": [
                {
                    "seconds": list(m.seconds),
                    "vector": m.vector.tolist(),
                    "rates": m.rates.tolist(),
                    "by_gyro": m.by_gyro,
                    "by_gravity": m.by_gravity,
                    "off": m.off,
                }  # fmt: skip
                for m in v.moves
            ],
        }
    return found
