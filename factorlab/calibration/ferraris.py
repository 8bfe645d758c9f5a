"""What a Ferraris session says: verdicts, constants and the sections on the timeline, as one document."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.calibration.parameters import Parameter
from factorlab.report.document import Cell, Document, Section, Status, Table, Verdict
from sequential.sensors import AffineCalibration, FerrarisFit, ImuRecording, Verification
from sequential.sensors.ferraris_sections import POSITIONS

__all__ = ["ferraris_document", "ferraris_parameters"]

STATUS: dict[str, Status] = {"note": "INFO", "warn": "WARN", "fail": "FAIL"}
LEVEL_GOOD, LEVEL_FAIR = 2.0, 5.0  # degrees between a position and its axis
CONSTANTS = (
    "Ferraris et al. (1995), closed form. The frame is that of the case's faces: tilts of the faces are "
    "taken to be as given, and are most of the intervals."
)
POSITIONS_READ = (
    "Calibrated mean of each position minus gravity along its axis. Both positions of an axis share it, "
    "since the offset is their mean: what is left across the axis is a table that is not level, or faces "
    "that are not square."
)


def ferraris_document(
    fit: FerrarisFit, recording: ImuRecording, command: str = "", trial: Verification | None = None
) -> Document:
    """Everything about a Ferraris session, for the screen, `--json` and the page."""
    from factorlab.report import field_figures as figures
    from factorlab.report.calibration_figures import intervals

    parameters = ferraris_parameters(fit)
    lines: list[tuple[Cell, ...]] = []
    for p in parameters:
        low, high = p.interval or (None, None)
        lines.append((p.sensor, p.name, p.value, low, high, p.unit))
    table = Table(("sensor", "constant", "value", "95 % from", "to", "unit"), tuple(lines), digits=5)
    left: tuple[tuple[Cell, ...], ...] = tuple(
        (name, *(float(v) for v in row)) for name, row in zip(POSITIONS, fit.residuals, strict=True)
    )
    seconds = tuple(
        (name, float(recording.seconds[rows[0]]), float(recording.seconds[rows[-1]]), len(rows))
        for name, rows in fit.sections.items()
    )
    numbers: dict[str, Any] = {
        "calibration": fit.calibration.to_dict(),
        "imucal": fit.to_imucal(),
        "parameters": [one.to_json() for one in parameters],
        "residuals": fit.residuals.tolist(),
        "sections": {name: [int(rows[0]), int(rows[-1]) + 1] for name, rows in fit.sections.items()},
    }
    if trial is not None:
        numbers["verification"] = {"name": trial.name, "rms": trial.rms}
    units = (("x", "m/s²"), ("y", "m/s²"), ("z", "m/s²"))
    return Document(
        "Calibration of accelerometer and gyro, by Ferraris' procedure",
        f"{recording.name}: {recording.duration:.0f} s at {recording.rate:.1f} Hz, six positions, 3 turns.",
        tuple(_verdicts(fit, trial)),
        (
            Section("Constants", CONSTANTS, table, lambda: intervals(parameters)),
            Section("Positions", POSITIONS_READ, Table(("position", *units), left)),
            Section(
                "Session",
                "",
                Table(("section", ("from", "s"), ("to", "s"), "samples"), seconds, digits=4),
                lambda: figures.session(recording, dict(fit.sections)),
            ),
        ),
        numbers,
        command=command,
    )


def ferraris_parameters(fit: FerrarisFit) -> tuple[Parameter, ...]:
    """Diagonal of the matrix, offset and cross-axis terms of both sensors, with 95 % intervals."""
    found: list[Parameter] = []
    for one in fit.calibration.present:
        found += _sensor(one)
    return tuple(found)


def _sensor(one: AffineCalibration) -> list[Parameter]:
    sigmas = one.sigmas()
    assert sigmas is not None  # noqa: S101 - the fit always gives a covariance
    same = one.unit_in == one.unit_out
    unit = "" if same else f"{one.unit_out.replace('^2', '²')} per {one.unit_in.removesuffix('s')}"
    gains = np.diag(one.matrix)
    found = []
    for k, axis in enumerate("xyz"):
        nominal = 1.0 if same else None
        found.append(_one(one.kind, f"gain {axis}", gains[k], sigmas[0][k, k], unit, nominal))
    for i, j in ((0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)):
        angle = np.degrees(one.matrix[i, j] / gains[j])
        sigma = np.degrees(sigmas[0][i, j] / abs(gains[j]))
        found.append(_one(one.kind, f"cross-axis {'xyz'[i]}{'xyz'[j]}", angle, sigma, "°", 0.0))
    for k, axis in enumerate("xyz"):
        shown = one.unit_in.replace("^2", "²")
        found.append(
            _one(one.kind, f"offset {axis}", one.offset[k], sigmas[1][k], shown, 0.0 if same else None)
        )
    return found


def _one(kind: str, name: str, value: float, sigma: float, unit: str, nominal: float | None) -> Parameter:
    half = 1.96 * float(sigma)
    limits = (float(value) - half, float(value) + half)
    return Parameter(kind, name, float(value), limits, unit, nominal, observed=True)


def _verdicts(fit: FerrarisFit, trial: Verification | None) -> list[Verdict]:
    across = fit.residuals - np.diag(np.ones(3)).repeat(2, axis=0) * fit.residuals
    gravity = float(np.abs(fit.residuals).max())
    angle = float(np.degrees(np.arcsin(min(1.0, np.linalg.norm(across, axis=1).max() / 9.80665))))
    status: Status = "PASS" if angle <= LEVEL_GOOD else "WARN" if angle <= LEVEL_FAIR else "FAIL"
    found = [
        Verdict(
            "positions against their axes, worst",
            angle,
            None,
            status,
            f"up and down of one axis are not opposite by twice that; {gravity:.3g} m/s² at most",
            "" if status == "PASS" else "hold the case against a square block on a level table",
            "°",
        )
    ]
    for one in fit.findings:
        what = f"{one.what} ({one.where})" if one.where else one.what
        found.append(Verdict("finding", None, None, STATUS[one.severity], what, one.do))
    if trial is not None and trial.rms is not None:
        fine: Status = "PASS" if trial.rms <= 0.05 else "WARN" if trial.rms <= 0.2 else "FAIL"
        meaning = f"{len(trial.dwells)} dwells that the constants were not made from"
        found.append(Verdict(f"|mean| − g on {trial.name}, RMS", trial.rms, None, fine, meaning, "", "m/s²"))
    return found
