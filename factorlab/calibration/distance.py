"""What the calibration of a distance sensor says, and the files that carry it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.report.document import Document, Section, Status, Table, Verdict
from sequential.errors import DataError
from sequential.sensors import RangeFit

__all__ = ["distance_document", "distance_files", "trial_rms"]

Array = NDArray[np.float64]
STATUS: dict[str, Status] = {"note": "INFO", "warn": "WARN", "fail": "FAIL"}
CURVE_READ = "The table and the curve, and what is left between them against two standard deviations."
SIGMA_READ = "What a reading says about the distance. Averaging helps down to what the constants leave."


def distance_document(
    fit: RangeFit,
    name: str,
    *,
    unit: str = "",
    reading_unit: str = "",
    limit: float | None = None,
    relative: float = 0.05,
    trial: tuple[str, Array, Array] | None = None,
    command: str = "",
) -> Document:
    """Everything about a distance sensor, for the screen, `--json` and the page.

    `trial` is another table that is read with this curve: its name, distances and readings.
    """
    from factorlab.report import field_figures as figures

    low, high = fit.span
    useful = fit.useful_range(limit, relative=relative)
    places = np.linspace(low, high, 9)
    rows = tuple(
        (float(d), float(fit.reading(d)), float(fit.sigma_at(d)), float(fit.sigma_at(d, samples=16)))
        for d in places
    )
    table = Table(
        (("distance", unit), ("reading", reading_unit), ("σ of one", unit), ("σ of the mean of 16", unit)),
        rows,
    )
    numbers: dict[str, Any] = {
        "constants": _constants(fit, unit, reading_unit),
        "span": [low, high],
        "useful_range": None if useful is None else list(useful),
        "limit": limit,
        "relative_limit": relative if limit is None else None,
        "folded_below": fit.folded_below,
        "sigma_at": [{"distance": row[0], "sigma": row[2]} for row in rows],
        "left_out": np.flatnonzero(~fit.used).tolist(),
    }
    verdicts = [*_constants_verdicts(fit, unit, reading_unit), _useful(useful, fit, unit, limit, relative)]
    verdicts += [Verdict("finding", None, None, STATUS[f.severity], f.what, f.do) for f in fit.findings]
    if trial is not None:
        rms, expected = trial_rms(fit, trial[1], trial[2])
        numbers["verification"] = {"name": trial[0], "rms": rms, "expected": expected}
        verdicts.append(_tried(trial[0], rms, expected, unit))
    used = int(fit.used.sum())
    return Document(
        "Calibration of the distance sensor",
        f"{name}: {used} of {len(fit.distances)} rows, {low:g} to {high:g} {unit}".rstrip() + ".",
        tuple(verdicts),
        (
            Section("Curve", "", None, lambda: figures.range_curve(fit, unit, reading_unit), CURVE_READ),
            Section(
                "Uncertainty of a distance",
                "",
                table,
                lambda: figures.range_sigma(fit, unit, limit, relative),
                SIGMA_READ,
            ),
        ),
        numbers,
        command=command,
    )


def trial_rms(fit: RangeFit, distances: Array, readings: Array) -> tuple[float, float]:
    """Root mean square of distance by this curve minus true distance on another table, and what is expected.

    Rows outside of this fit's span are not tried.

    Raises
    ------
    DataError
        where no row is inside.
    """
    low, high = fit.span
    inside = (distances >= low) & (distances <= high)
    found = fit.distance(readings)
    inside &= np.isfinite(found)
    if not inside.any():
        raise DataError(
            f"no row of the second table is between {low:g} and {high:g}, where the curve was fitted"
        )
    error = found[inside] - distances[inside]
    sigma = fit.sigma_at(distances[inside])
    return float(np.sqrt(np.mean(error**2))), float(np.sqrt(np.mean(sigma**2)))


def _tried(name: str, rms: float, expected: float, unit: str) -> Verdict:
    ratio = rms / expected if expected > 0 else np.inf
    status: Status = "PASS" if ratio < 1.5 else "WARN" if ratio < 3 else "FAIL"
    meaning = f"RMS error of the distance; {expected:.3g} {unit} expected".rstrip()
    action = "" if status == "PASS" else "another surface, supply or sensor: make a table for it"
    return Verdict(f"distance on {name}", rms, None, status, meaning, action, unit)


def _constants(fit: RangeFit, unit: str, reading_unit: str) -> dict[str, Any]:
    return {
        "model": "v = a / (d + b) + c",
        "a": fit.a,
        "b": fit.b,
        "c": fit.c,
        "cov": fit.cov.tolist(),
        "reading_sigma": fit.sigma,
        "distance_unit": unit,
        "reading_unit": reading_unit,
    }


def _constants_verdicts(fit: RangeFit, unit: str, reading_unit: str) -> list[Verdict]:
    product = f"{reading_unit}·{unit}" if unit and reading_unit else ""
    found = []
    for k, (letter, shown, meaning) in enumerate(
        (
            ("a", product, "gain"),
            ("b", unit, "offset of the distance"),
            ("c", reading_unit, "reading far away"),
        )
    ):
        value, half = float(fit.parameters[k]), 1.96 * float(np.sqrt(fit.cov[k, k]))
        found.append(Verdict(letter, value, (value - half, value + half), "INFO", meaning, "", shown))
    found.append(
        Verdict("σ of a reading", fit.sigma, None, "INFO", "noise and model together", "", reading_unit)
    )
    return found


def _useful(
    useful: tuple[float, float] | None, fit: RangeFit, unit: str, limit: float | None, relative: float
) -> Verdict:
    asked = f"{100 * relative:g} % of the distance" if limit is None else f"{limit:g} {unit}".rstrip()
    if useful is None:
        meaning = f"nowhere is σ below {asked}"
        return Verdict("useful range", None, None, "FAIL", meaning, "average readings, or allow more")
    whole = np.allclose(useful, fit.span, rtol=2e-3)
    meaning = f"σ of one reading is below {asked}" + (" over all of the table" if whole else "")
    return Verdict("useful range", f"{useful[0]:.3g} to {useful[1]:.3g}", None, "PASS", meaning, "", unit)


def distance_files(fit: RangeFit, name: str, unit: str, reading_unit: str) -> dict[str, str]:
    """calibration.json and calibration.h."""
    source = name.replace("*/", "* /")
    low, high = fit.span
    lines = [
        "/* Distance sensor: reading = a / (distance + b) + c, so distance = a / (reading - c) - b.",
        f" * Source: {source}; distance in {unit or 'its unit'}, reading in {reading_unit or 'its unit'}.",
        " */",
        "#ifndef FACTORLAB_RANGE_CALIBRATION_H",
        "#define FACTORLAB_RANGE_CALIBRATION_H",
        "",
        *(
            f"static const float range_{letter} = {float(np.float32(value)):.9e}f;"
            for letter, value in (
                *zip("abc", fit.parameters, strict=True),
                ("shortest", low),
                ("longest", high),
            )
        ),
        "",
        "#endif /* FACTORLAB_RANGE_CALIBRATION_H */",
        "",
    ]
    constants = {"schema": "factorlab-range-calibration", "version": 1, "source": name, "span": [low, high]}
    body = constants | _constants(fit, unit, reading_unit)
    return {
        "calibration.json": json.dumps(body, indent=1, allow_nan=False) + "\n",
        "calibration.h": "\n".join(lines),
    }
