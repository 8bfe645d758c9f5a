"""The numbers of a stereo calibration for a machine, and the files beside the report."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np

from factorlab.stereo.calibrated import CalibratedStereo

__all__ = ["stereo_files", "stereo_numbers"]

SIDES = ("left", "right")
POSE = ("rx_rad", "ry_rad", "rz_rad", "px_m", "py_m", "pz_m")
CORNERS = "pair side picture corner x_px y_px sigma_px residual_x_px residual_y_px used x_m y_m z_m"
PAIRS = (
    "pair left right qw qx qy qz px_m py_m pz_m rms_left_px rms_right_px rows_px left_out_rows_px chi2 moved"
)


def stereo_numbers(done: CalibratedStereo) -> dict[str, Any]:
    """What `report.json` and `--json` say besides verdicts."""
    from vision3d.stereo.rig_json import rig_record

    fit, held, sizes = done.calibration, done.held, done.measured
    rig = fit.rig
    return {
        "board": done.settings.board.name,
        "rig": rig_record(rig),
        "baseline_std_m": rig.baseline_std_m,
        "rotation_deg": float(np.degrees(rig.angle_rad)),
        "pose_std": dict(zip(POSE, fit.std[:6].tolist(), strict=True)),
        "cameras": {
            side: {
                "parameters": dict(zip(camera.names, camera.parameters.tolist(), strict=True)),
                "std": dict(zip(camera.names, std.tolist(), strict=True)),
                "held": not bool(std.any()),
            }
            for side, camera, std in zip(SIDES, (rig.left, rig.right), fit.camera_stds, strict=True)
        },
        "rms_px": fit.rms_px,
        "rms_left_px": fit.rms_left_px,
        "rms_right_px": fit.rms_right_px,
        "rms_all_corners_px": fit.rms_all_px,
        "rectified_row_error_px": sizes.row_px,
        "left_out_row_error_px": None if held is None else held.row_px,
        "left_out_rms_px": None if held is None else held.rms_px,
        "square": {
            "triangulated_m": sizes.side_m,
            "std_m": sizes.side_std_m,
            "true_m": sizes.true_side_m,
            "count": sizes.count,
        },
        "pairs": {
            "given": done.given,
            "used": len(fit.whole),
            "how": done.pictures.how,
            "left_out": done.lost,
            "disagreeing": [
                {"pair": one.name, "rms_px": one.rms_px, "exchanged": one.exchanged}
                for one in fit.disagreeing
            ],
            "renumbered": list(fit.renumbered),
            "table": [_pair(done, v) for v in range(len(fit.pairs))],
        },
        "moved": _moved(done),
        "outliers": [
            {"side": SIDES[side], "pair": fit.pairs[pair].name, "corner": corner}
            for side, pair, corner in fit.outliers
        ],
        "inflation": fit.inflation,
        "sigma_px": dict(zip(SIDES, fit.sigma_px, strict=True)),
        "board_warp": {"rise_m": fit.warp.tolist(), "std_m": fit.std[-2:].tolist()},
        "rectified": _rectified(done),
        "uncertainty": _uncertainty(done),
        "findings": list(fit.report.findings),
        "seconds": done.seconds,
    }


def _pair(done: CalibratedStereo, v: int) -> dict[str, Any]:
    fit, held = done.calibration, done.held
    pair, rms = fit.pairs[v], fit.pair_rms[v]
    names = {
        side: None if view is None else view.name
        for side, view in zip(SIDES, (pair.left, pair.right), strict=True)
    }
    return {
        "pair": pair.name,
        **names,
        "rms_px": rms.tolist(),
        "row_error_px": float(done.measured.pair_row_px[v]) if pair.is_whole else None,
        "left_out_row_error_px": float(held.pair_row_px[v]) if held is not None and pair.is_whole else None,
        "left_T_board": fit.poses[v].tolist(),
        "std": np.sqrt(np.diag(fit.pose_covs[v])).tolist(),
    }


def _moved(done: CalibratedStereo) -> dict[str, Any]:
    found, fit = done.deviations, done.calibration
    step = found.step
    return {
        "pairs": [fit.pairs[v].name for v in found.moved],
        "scatter": found.scatter,
        "chi2": {fit.pairs[v].name: float(value) for v, value in zip(found.pairs, found.chi2, strict=True)},
        "step": None
        if step is None
        else {
            "after": fit.pairs[step.before].name,
            "before": fit.pairs[step.after].name,
            "rotation_deg": float(np.degrees(step.rotation_rad)),
            "translation_m": step.translation_m,
        },
    }


def _rectified(done: CalibratedStereo) -> dict[str, Any]:
    pair = done.rectification
    return {
        "size": list(pair.size),
        "focal_px": pair.focal_px,
        "baseline_m": pair.baseline_m,
        "principal_point_px": pair.left.intrinsics[2:].tolist(),
        "doffs_px": pair.doffs_px,
        "valid": list(pair.valid),
        "Q": pair.Q.tolist(),
    }


def _uncertainty(done: CalibratedStereo) -> dict[str, Any]:
    depths, std = done.depth_spread
    rows = done.uncertainty.row_std_px
    return {
        "distance_m": done.distance_m,
        "row_std_px": {"middle": float(rows[len(rows) // 2]), "worst": float(np.nanmax(rows))},
        "depth_m": depths.tolist(),
        "depth_std_m": std.tolist(),
    }


def stereo_files(done: CalibratedStereo) -> dict[str, str | bytes]:
    """Names and contents of the files of the folder: the rig in every format that can say it, and tables."""
    from vision3d.stereo.rig_files import rig_texts

    return {
        **rig_texts(done.calibration.rig),
        "corners.csv": _corners_csv(done),
        "pairs.csv": _pairs_csv(done),
    }


def _corners_csv(done: CalibratedStereo) -> str:
    fit, text = done.calibration, io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(CORNERS.split())
    for (side, v), residuals, weights, sigma in zip(
        fit.pictures, fit.residuals, fit.weights, done.sigmas, strict=True
    ):
        view = fit.pairs[v].left if side == 0 else fit.pairs[v].right
        assert view is not None  # noqa: S101 - a picture shows the board
        table = np.column_stack([view.pixels, sigma, residuals])
        for row, corner, weight, point in zip(table, view.ids, weights, view.points, strict=True):
            own = [f"{value:.8g}" for value in row]
            place = [f"{value:.9g}" for value in point]
            out.writerow([fit.pairs[v].name, SIDES[side], view.name, corner, *own, int(weight > 0.0), *place])
    return text.getvalue()


def _pairs_csv(done: CalibratedStereo) -> str:
    fit, text = done.calibration, io.StringIO()
    chi2 = dict(zip(done.deviations.pairs, done.deviations.chi2.tolist(), strict=True))
    out = csv.writer(text, lineterminator="\n")
    out.writerow(PAIRS.split())
    for v, one in enumerate(fit.pairs):
        own = _pair(done, v)
        numbers = [*own["rms_px"], own["row_error_px"], own["left_out_row_error_px"], chi2.get(v)]
        told = ["" if value is None or not np.isfinite(value) else f"{value:.5f}" for value in numbers]
        pose = [f"{value:.9g}" for value in fit.poses[v]]
        moved = int(v in done.deviations.moved)
        out.writerow([one.name, own["left"] or "", own["right"] or "", *pose, *told, moved])
    return text.getvalue()
