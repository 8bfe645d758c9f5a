"""Ferraris against imucal's file; how even a calibrated magnetometer is: `python field_figures.py [--json]`.

Needs FACTORLAB_DATA.  The spread is the standard deviation over the mean of the mean norms of 24 equal-area
cells of direction (4 bands of elevation by 6 of azimuth), over raw samples, the mean excess by noise off.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
from measure.figures import Figure, publish, say

from sequential.manifold.quaternion import rotation_matrix
from sequential.readers import read_broad, read_imu
from sequential.readers.imu.sections import read_labels
from sequential.sensors import Ferraris, ImuRecording, MagnetometerEllipsoid, MagnetometerFit
from sequential.sensors.direction_cells import cell_means

TURNED = 40  # random orientations of the cells


def ferraris(folder: Path) -> dict[str, Figure]:
    """Largest difference to the expected file, in its own units."""
    say("Ferraris: imucal's annotated session")
    path = folder / "annotated_session.csv"
    recording = read_imu(path, rate=204.8, units="accel=counts,gyro=counts")
    ours = Ferraris(gravity=9.81).calibrate(recording, read_labels(path)).to_imucal()
    expected = json.loads((folder / "example_cal.json").read_text(encoding="utf-8"))
    apart = max(np.abs(np.subtract(ours[k], v)).max() for k, v in expected.items() if isinstance(v, list))
    return {"imucal_json": Figure(float(apart), "", "expected JSON", 1e-6, 1e-8)}


def averaged(fit: MagnetometerFit, recording: ImuRecording, seconds: float) -> float:
    """Spread after a moving mean of raw readings: what turning within the window costs."""
    assert recording.mag is not None
    width = max(1, round(seconds * recording.rate))
    total = np.cumsum(np.vstack([np.zeros(3), recording.mag]), axis=0)
    return cell_means(fit.calibration.apply((total[width:] - total[:-width]) / width)).spread


def wandering(fit: MagnetometerFit, recording: ImuRecording, seconds: float = 50.0) -> float:
    """RMS over the axes of the hard iron's change from window to window, in fields, its noise taken off."""
    norms, vectors = fit.check.norms, fit.check.vectors
    towards = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    time = recording.seconds[fit.readings.rows]
    excess = []
    for start in np.arange(60.0, recording.duration - seconds, seconds):
        rows = (time >= start) & (time < start + seconds)
        design = np.column_stack([towards[rows], np.ones(rows.sum())])
        shift = np.linalg.lstsq(design, norms[rows] - 1)[0][:3]
        noise = fit.fit.sigma**2 * np.diag(np.linalg.inv(design.T @ design))[:3]
        excess.append(shift**2 - noise)
    return float(np.sqrt(max(0.0, np.mean(excess))))


def magnetometer(path: Path) -> dict[str, Figure]:
    """The turns of the QMC5883L: judged on all, on the other half, with turned cells, with moving means."""
    say("QMC5883L: turns by hand")
    recording = read_imu(path)
    fit = MagnetometerEllipsoid().calibrate(recording)
    check, rng = fit.check, np.random.default_rng(0)
    turned = []
    for _ in range(TURNED):
        q = rng.standard_normal(4)
        cells = cell_means(check.vectors @ rotation_matrix(q / np.linalg.norm(q)), check.norms)
        turned.append(cells.spread)
    middle = recording.duration / 2 + 30  # the first minute is at rest
    halves = [recording.slice(60, middle), recording.slice(middle)]
    other = [
        MagnetometerEllipsoid().calibrate(a).verify(b).calibrated.spread for a, b in (halves, halves[::-1])
    ]
    plain, wander = np.linalg.norm(check.vectors, axis=1), wandering(fit, recording)
    noise = f"noise alone {100 * check.cell_noise:.2f}; raw {100 * check.raw.spread:.1f}"
    return {
        "qmc_spread": Figure(100 * check.calibrated.spread, "%", f"2.4 for 0.3 s means; {noise}", 2.0, 1.0),
        "qmc_spread_turned_cells": Figure(
            100 * max(turned), "%", f"worst of {TURNED} orientations", 2.0, 1.0
        ),
        "qmc_spread_norms_as_they_are": Figure(
            100 * cell_means(check.vectors, plain).spread, "%", "excess by noise left in", 2.0, 1.0
        ),
        "qmc_spread_other_half": Figure(
            100 * max(other), "%", "fitted on one half, judged on the other; worse of two", 2.0
        ),
        "qmc_spread_mean_0.1s": Figure(100 * averaged(fit, recording, 0.1), "%", "readings averaged, 0.1 s"),
        "qmc_spread_mean_0.3s": Figure(
            100 * averaged(fit, recording, 0.3), "%", "0.3 s: the mean of a turning vector is shorter"
        ),
        "qmc_spread_mean_0.5s": Figure(100 * averaged(fit, recording, 0.5), "%", "0.5 s"),
        "qmc_offset_wander": Figure(
            100 * wander, "%", "hard iron of 50 s windows about its mean, noise off: limits the rows above"
        ),
        "qmc_scatter_over_noise": Figure(
            fit.fit.sigma / fit.fit.expected, "x", "scatter of one norm over the sensor's noise", None, 1.1
        ),
    }


def broad(folder: Path) -> dict[str, Figure]:
    """Norm of single readings before and after, in a room whose field differs from place to place."""
    found = {}
    for path in sorted(folder.glob("*.npz")):
        if path.name[:2] in {"05", "29"}:
            say(f"BROAD {path.name[:2]}")
            recording, _ = read_broad(path)
            fit = MagnetometerEllipsoid().calibrate(recording)
            kept = fit.check.norms[~fit.outliers]
            found[f"broad_{path.name[:2]}_norm_scatter"] = Figure(
                100 * float(kept.std() / kept.mean()),
                "%",
                f"{100 * fit.check.raw_scatter:.2f} raw; {100 * fit.outliers.mean():.1f} % left out",
            )
    return found


def figures() -> dict[str, Figure]:
    """All of the above, for the benchmark of IMU calibration."""
    folder = Path(os.environ["FACTORLAB_DATA"]) / "imu"
    qmc = folder / "qmc5883l" / "noisy_raw_data.csv"
    return {**ferraris(folder / "imucal"), **magnetometer(qmc), **broad(folder / "broad")}


if __name__ == "__main__":
    if not os.environ.get("FACTORLAB_DATA"):
        sys.exit("field_figures needs the real recordings: set FACTORLAB_DATA to their folder")
    sys.exit(publish(figures()))
