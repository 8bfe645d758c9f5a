"""The page of a stereo calibration: verdicts, the rig, rows, pairs, residuals, how sure depths are."""

from __future__ import annotations

import numpy as np

from factorlab.report.document import Document, Section, Table
from factorlab.stereo.calibrated import CalibratedStereo
from factorlab.stereo.calibration_numbers import stereo_numbers
from factorlab.stereo.calibration_verdicts import stereo_verdicts

__all__ = ["stereo_document"]

RIG_TOLD = (
    "right_T_left: where the left camera is in the right one's frame (x right, y down, z forward), as "
    "OpenCV's R and T. Its σ are those of a step in the left camera's axes."
)
PAIR_READ = (
    "A pair of the calibration, rectified without black borders: a line goes through the same things in both "
    "images. Dashed: what both cameras fill."
)
ROWS_READ = (
    "Left: one colour over a region is what lens or pose do not follow. Right: diamonds are pairs that the "
    "rig had not seen."
)
POSES_READ = (
    "Every pair alone, both cameras held, gives a pose of the right camera to the left one; its distance "
    "from that of all pairs, with 2σ. A step in all later pairs is a knock; one pair alone, a board or rig "
    "in motion."
)
RESIDUALS_READ = (
    "Orange where a corner was left out. Arrows that lie together are what the lens does not follow."
)
SURE_READ = (
    "From the covariance of the calibration. Left: rows that a matcher searches are wrong by as much; white "
    "dots are the corners that it was made from. Right: an error of calibration does not average out."
)


def stereo_document(done: CalibratedStereo, command: str = "") -> Document:
    """Everything about a stereo calibration, for the screen, `--json` and the page."""
    fit = done.calibration
    rig = fit.rig
    sizes = " and ".join(dict.fromkeys(f"{w}x{h}" for w, h in (rig.left.size, rig.right.size)))
    lenses = " and ".join(dict.fromkeys((rig.left.lens, rig.right.lens)))
    lead = (
        f"{done.settings.board.name} in {len(fit.whole)} of {done.given} pairs of {sizes}; {lenses}, RMS "
        f"{fit.rms_px:.3f} px, rows {done.measured.row_px:.3f} px apart, baseline "
        f"{1e3 * rig.baseline_m:.2f} mm."
    )
    numbers = stereo_numbers(done)
    return Document(
        "Calibration of a stereo rig",
        lead,
        stereo_verdicts(done),
        tuple(_sections(done)),
        numbers,
        command=command,
    )


def _sections(done: CalibratedStereo) -> list[Section]:
    from factorlab.report import stereo_calibration_figures as figures

    return [
        Section("Rig", RIG_TOLD, _rig(done)),
        Section("Cameras", "", _cameras(done)),
        Section("A rectified pair", "", None, lambda: figures.rectified_pair(done), PAIR_READ),
        Section("Rows", "", None, lambda: figures.row_differences(done), ROWS_READ),
        Section("Pose of the cameras, pair by pair", "", None, lambda: figures.pair_poses(done), POSES_READ),
        Section("Residuals over the images", "", None, lambda: figures.residual_fields(done), RESIDUALS_READ),
        Section("How sure rows and depths are", "", None, lambda: figures.depth_spread(done), SURE_READ),
        Section("Pairs", "", _pairs(done), page_only=True),
    ]


def _rig(done: CalibratedStereo) -> Table:
    from sequential.manifold.quaternion import quaternion_log

    fit = done.calibration
    rig = fit.rig
    turn = np.degrees(quaternion_log(rig.right_T_left[:4]))
    rows: list[tuple[str, float, float | None, str]] = [
        ("baseline", 1e3 * rig.baseline_m, 1e3 * (rig.baseline_std_m or 0.0), "mm")
    ]
    for k, axis in enumerate("xyz"):
        rows.append((f"rotation about {axis}", float(turn[k]), float(np.degrees(fit.std[k])), "°"))
    for k, axis in enumerate("xyz"):
        rows.append((f"translation along {axis}", 1e3 * float(rig.T[k]), 1e3 * float(fit.std[3 + k]), "mm"))
    pair = done.rectification
    rows.append(("focal length, rectified", pair.focal_px, None, "px"))
    return Table(("constant", "value", "σ", "unit"), tuple(rows), digits=5)


def _cameras(done: CalibratedStereo) -> Table:
    fit = done.calibration
    values = [
        {
            name: (value, std or None)
            for name, value, std in zip(camera.names, camera.parameters.tolist(), stds.tolist(), strict=True)
        }
        for camera, stds in zip((fit.rig.left, fit.rig.right), fit.camera_stds, strict=True)
    ]
    names = dict.fromkeys([*values[0], *values[1]])
    rows = tuple(
        (name, *values[0].get(name, (None, None)), *values[1].get(name, (None, None)),
         "px" if name in ("fx", "fy", "cx", "cy") else "")
        for name in names
    )  # fmt: skip
    return Table(("constant", "left", "σ", "right", "σ", "unit"), rows, digits=6)


def _pairs(done: CalibratedStereo) -> Table:
    fit, held = done.calibration, done.held
    chi2 = dict(zip(done.deviations.pairs, done.deviations.chi2.tolist(), strict=True))
    rows = []
    for v, pair in enumerate(fit.pairs):
        corners = [0 if view is None else len(view) for view in (pair.left, pair.right)]
        rms = [float(value) if np.isfinite(value) else None for value in fit.pair_rms[v]]
        row = float(done.measured.pair_row_px[v]) if pair.is_whole else None
        out = float(held.pair_row_px[v]) if held is not None and pair.is_whole else None
        remark = "moved" if v in done.deviations.moved else "" if pair.is_whole else "one picture of it"
        rows.append((pair.name, *corners, *rms, row, out, chi2.get(v), remark))
    headings = (
        "pair", "corners left", "right", ("RMS left", "px"), ("right", "px"), ("rows", "px"),
        ("left out", "px"), "χ² (6)", "remarks",
    )  # fmt: skip
    return Table(headings, tuple(rows))
