"""What a magnetometer's calibration says: verdicts, constants and figures, as one document."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.calibration.parameters import Parameter
from factorlab.report.document import Cell, Document, Section, Status, Table, Verdict
from sequential.sensors import FieldAlignment, FieldCheck, Finding, ImuRecording, MagnetometerFit
from sequential.sensors.direction_cells import CELLS

__all__ = ["magnetometer_document", "magnetometer_parameters"]

EVEN, FAIR = 0.02, 0.05  # spread of the mean norm over directions: good, and of use
STATUS: dict[str, Status] = {"note": "INFO", "warn": "WARN", "fail": "FAIL"}
CONSTANTS = (
    "calibrated = matrix · (raw − offset). The offset is hard iron, the matrix soft iron and axes' gains. "
    "Norms leave a rotation free: of all matrices that fit, this is the symmetric one, unless aligned. "
    "Radii are the ellipsoid's, smallest first."
)
NOISE = (
    "Noise lengthens a norm: |m + n| is above |m| on the average, by half the noise variance across m over "
    "|m|. Norms here have that taken off, and so has the fit."
)
PROJECTIONS_READ = "Every reading along each axis: the ellipsoid above, the sphere that it becomes below."
CELLS_READ = "24 cells of equal area: mean norm against the mean of all cells, and readings in it."


def magnetometer_document(
    fit: MagnetometerFit,
    recording: ImuRecording,
    command: str = "",
    trial: tuple[str, FieldCheck] | None = None,
    alignment: FieldAlignment | None = None,
) -> Document:
    """Everything about a magnetometer's calibration, for the screen, `--json` and the page."""
    parameters = magnetometer_parameters(fit)
    lead = (
        f"{recording.name}: {recording.duration:.0f} s at {recording.rate:.0f} Hz, {len(fit.readings.rows)} "
        f"readings; field {fit.field:.4g} {fit.calibration.unit_out}."
    )
    numbers: dict[str, Any] = {
        "field": fit.field,
        "unit": fit.calibration.unit_out,
        "planar": fit.planar,
        "radii": fit.radii.tolist(),
        "radii_sigma": fit.radii_sigma.tolist(),
        "noise": np.sqrt(np.diag(fit.readings.noise_cov)).tolist(),
        "outliers": int(fit.outliers.sum()),
        "readings": len(fit.outliers),
        "scatter_robust": fit.fit.sigma,
        "scatter_of_noise": fit.fit.expected,
        "before_after": _check(fit.check),
        "calibration": fit.calibration.to_dict(),
        "parameters": [one.to_json() for one in parameters],
    }
    if alignment is not None:
        numbers["alignment"] = {
            "using": alignment.using,
            "rotation": alignment.rotation.tolist(),
            "cov": alignment.cov.tolist(),
            "residual": alignment.residual,
            "dip": alignment.dip,
        }
    if trial is not None:
        numbers["verification"] = {"name": trial[0]} | _check(trial[1])
    return Document(
        "Calibration of the magnetometer",
        lead,
        (*_verdicts(fit, trial), *([] if alignment is None else [_aligned(alignment)])),
        tuple(_sections(fit, parameters, trial)),
        numbers,
        command=command,
    )


def magnetometer_parameters(fit: MagnetometerFit) -> tuple[Parameter, ...]:
    """Radii and offsets with 95 % intervals."""
    unit = fit.calibration.unit_in
    named = [
        ("radius", f"{k + 1}", value, sigma)
        for k, (value, sigma) in enumerate(zip(fit.radii, fit.radii_sigma, strict=True))
    ]
    sigmas = fit.calibration.sigmas()
    assert sigmas is not None  # noqa: S101 - the fit always gives a covariance
    named += [
        ("offset", axis, value, sigma)
        for axis, value, sigma in zip("xyz", fit.calibration.offset, sigmas[1], strict=True)
    ]
    return tuple(
        Parameter(
            "mag",
            f"{kind} {place}",
            float(value),
            (float(value - 1.96 * sigma), float(value + 1.96 * sigma)),
            unit,
            None,
            bool(sigma < 0.3 * fit.radii.mean()),
        )
        for kind, place, value, sigma in named
    )


def _check(check: FieldCheck) -> dict[str, Any]:
    return {
        "spread_raw": check.raw.spread,
        "spread": check.calibrated.spread,
        "spread_of_noise": check.cell_noise,
        "cells": check.calibrated.covered,
        "scatter_raw": check.raw_scatter,
        "scatter": check.scatter,
        "scatter_of_noise": check.noise_share,
        "cell_means": check.calibrated.mean.tolist(),
        "cell_counts": check.calibrated.count.tolist(),
    }


def _verdicts(fit: MagnetometerFit, trial: tuple[str, FieldCheck] | None) -> list[Verdict]:
    found = [_spread("norm over directions, spread", fit.check), _scatter(fit)]
    if not fit.planar:
        found.append(_coverage(fit.check))
    found += [_finding(one) for one in fit.findings]
    if trial is not None:
        found.append(_spread(f"norm over directions on {trial[0]}, spread", trial[1]))
    return found


def _spread(metric: str, check: FieldCheck) -> Verdict:
    value = check.calibrated.spread
    if not np.isfinite(value):
        return Verdict(metric, None, None, "INFO", "too few directions with 20 readings to compare")
    meaning = (
        f"mean norms of {check.calibrated.covered} cells of direction; {100 * check.raw.spread:.2g} % raw; "
        f"noise alone would make {100 * check.cell_noise:.2g} %"
    )
    status: Status = "PASS" if value <= EVEN else "WARN" if value <= FAIR else "FAIL"
    action = "" if status == "PASS" else "calibrate anew where the sensor is used, away from iron"
    return Verdict(metric, 100 * value, None, status, meaning, action, "%")


def _scatter(fit: MagnetometerFit) -> Verdict:
    robust, noise = fit.fit.sigma, fit.fit.expected
    ratio = robust / noise if noise > 0 else np.inf
    meaning = f"robust; the noise of a reading explains {100 * noise:.2g} %"
    if ratio <= 1.5:
        return Verdict("norm of one reading, scatter", 100 * robust, None, "PASS", meaning, "", "%")
    status: Status = "INFO" if robust < 0.03 else "WARN"
    meaning += ": the rest is a field that differs from place to place"
    return Verdict("norm of one reading, scatter", 100 * robust, None, status, meaning, "", "%")


def _aligned(one: FieldAlignment) -> Verdict:
    sigma = float(np.degrees(np.sqrt(np.linalg.eigvalsh(one.cov)[-1])))
    meaning = f"known to {sigma:.2g}° (1σ); single directions scatter by {np.degrees(one.residual):.2g}°" + (
        "" if one.dip is None else f"; dip of the field {np.degrees(one.dip):.1f}°"
    )
    metric = f"magnetometer's axes off the {one.using}'s, at most"
    status: Status = "PASS" if sigma < 1 else "WARN"
    return Verdict(metric, float(np.degrees(one.angle)), None, status, meaning, "", "°")


def _coverage(check: FieldCheck) -> Verdict:
    count = check.calibrated.covered
    status: Status = "PASS" if count >= 20 else "WARN"
    action = "" if status == "PASS" else "turn the sensor into the empty cells of the map"
    return Verdict(
        "directions covered", f"{count} of {CELLS}", None, status, "cells with 20 readings at least", action
    )


def _finding(one: Finding) -> Verdict:
    what = f"{one.what} ({one.where})" if one.where else one.what
    return Verdict("finding", None, None, STATUS[one.severity], what, one.do)


def _sections(
    fit: MagnetometerFit, parameters: tuple[Parameter, ...], trial: tuple[str, FieldCheck] | None
) -> list[Section]:
    from factorlab.report import field_figures as figures

    rows: list[tuple[Cell, ...]] = []
    for one in parameters:
        low, high = one.interval or (None, None)
        rows.append((one.name, one.value, low, high, one.unit, "" if one.observed else "not seen"))
    table = Table(("constant", "value", "95 % from", "to", "unit", ""), tuple(rows), digits=5)
    matrix: tuple[tuple[Cell, ...], ...] = tuple(
        (f"row {axis}", *(float(v) for v in row))
        for axis, row in zip("xyz", fit.calibration.matrix, strict=True)
    )
    found = [
        Section("Constants", CONSTANTS, table),
        Section("Matrix", "", Table(("", "x", "y", "z"), matrix, digits=5)),
        Section("Ellipsoid and sphere", "", None, lambda: figures.projections(fit), PROJECTIONS_READ),
        Section(
            "Norms", NOISE, None, lambda: figures.norm_histogram(fit, None if trial is None else trial[1])
        ),
        Section("Directions", "", None, lambda: figures.cell_map(fit.check), CELLS_READ),
    ]
    if trial is not None:
        check = trial[1]
        found.append(Section(f"Tried on {trial[0]}", "", None, lambda: figures.cell_map(check), CELLS_READ))
    return found
