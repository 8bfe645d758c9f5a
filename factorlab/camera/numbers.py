"""The numbers of a camera's calibration for a machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.camera.calibrated import CalibratedCamera

__all__ = ["numbers_of"]


def numbers_of(done: CalibratedCamera) -> dict[str, Any]:
    """What `report.json` and `--json` say besides verdicts."""
    from vision3d.camera_files.own_json import camera_record

    fit = done.calibration
    camera = fit.camera
    values, stds = camera.parameters.tolist(), fit.std.tolist()
    return {
        "board": done.settings.board.name,
        "views": {
            "given": done.given,
            "used": len(fit.views),
            "left_out": done.lost,
            "table": [_view(done, k) for k in range(len(fit.views))],
        },
        "detection": _detection(done),
        "rms_px": fit.rms_px,
        "leave_one_out_rms_px": None if done.cross is None else done.cross.rms_px,
        "sigma_px": fit.sigma_px,
        "camera": camera_record(camera)
        | {
            "parameters": dict(zip(fit.names, values, strict=True)),
            "std": dict(zip(fit.names, stds, strict=True)),
            "covariance": fit.cov.tolist(),
            "matrix": camera.matrix.tolist(),
        },
        "outliers": {
            "corners": [{"picture": fit.views[view].name, "corner": corner} for view, corner in fit.outliers],
            "pictures": [fit.views[view].name for view in fit.outlier_views],
        },
        "lenses": _lenses(done),
        "board_warp": {
            "estimated": bool(fit.warp_std.any()),
            "rise_m": fit.warp.tolist(),
            "std_m": fit.warp_std.tolist(),
            "flat_left_out_rms_px": done.fitted.flat_px,
        },
        "inflation": fit.inflation,
        "uncertainty": _uncertainty(done),
        "coverage": done.coverage.bars | {"advice": list(done.coverage.advice)},
        "next_pose": _following(done),
        "difference": _difference(done),
        "condition": fit.report.condition,
        "findings": list(fit.report.findings),
        "seconds": done.seconds,
    }


def _lenses(done: CalibratedCamera) -> dict[str, Any]:
    """Every lens that was tried."""
    if done.choice is None:
        return {}
    return {
        row.lens: {
            "coefficients": row.coefficients,
            "rms_px": row.train_rms_px,
            "left_out_rms_px": row.held_out_rms_px,
            "seconds": row.seconds,
            "remark": row.remark,
        }
        for row in done.choice.table
    }


def _uncertainty(done: CalibratedCamera) -> dict[str, Any]:
    """The map of the projection's standard deviation, rows of the grid from the top."""
    one, freed = done.uncertainty, done.uncertainty_freed
    columns = one.map_px.shape[1]
    return {
        "x_px": one.pixels[:columns, 0].tolist(),
        "y_px": one.pixels[::columns, 1].tolist(),
        "std_px": one.map_px.tolist(),
        "std_freed_px": freed.map_px.tolist(),
        "worst_px": float(np.nanmax(one.map_px)),
        "worst_at": done.worst_place,
    }


def _following(done: CalibratedCamera) -> dict[str, Any] | None:
    """Where to hold the board next."""
    if (found := done.following) is None:
        return None
    return {
        "words": found.words,
        "camera_T_board": found.camera_T_board.tolist(),
        "tilt_deg": float(np.degrees(found.tilt_rad)),
        "distance_m": found.distance_m,
        "gain": found.gain,
        "std_before_px": found.std_before_px,
        "std_after_px": found.std_after_px,
    }


def _difference(done: CalibratedCamera) -> dict[str, Any] | None:
    """How far the other calibration is."""
    if (found := done.difference) is None:
        return None
    return {
        "with": str(done.settings.compare),
        "rms_px": found.rms_px,
        "max_px": found.max_px,
        "sigmas": found.sigmas,
        "words": found.words,
    }


def _detection(done: CalibratedCamera) -> dict[str, Any]:
    """What the audit of the corners says."""
    audits = done.detections.audits
    return {
        "window_px": done.settings.window,
        "window_too_large": [
            audit.name for audit in audits if done.settings.window is not None and audit.window_too_large
        ],
        "moved": [
            {"picture": audit.name, "corner": corner, "by_px": px}
            for audit in audits
            for corner, px in audit.moved
        ],
        "suspicious": [
            {"picture": audit.name, "corner": corner} for audit in audits for corner in audit.suspicious
        ],
        "findings": list(done.detections.findings),
    }


def _view(done: CalibratedCamera, k: int) -> dict[str, Any]:
    fit, view = done.calibration, done.calibration.views[k]
    return {
        "picture": view.name,
        "corners": len(view),
        "left_out": int((~done.used[k]).sum()),
        "rms_px": float(fit.view_rms[k]),
        "predicted_rms_px": None if done.cross is None else float(done.cross.view_rms[k]),
        "tilt_deg": float(np.degrees(done.tilts[k])),
        "distance_m": float(done.distances[k]),
        "camera_T_board": fit.poses[k].tolist(),
        "std": np.sqrt(np.diag(fit.pose_covs[k])).tolist(),
        "findings": list(view.findings),
    }
