"""The files beside the report: the camera in the formats of others, and what it was made from."""

from __future__ import annotations

import csv
import io

import numpy as np

from factorlab.camera.calibrated import CalibratedCamera

__all__ = ["export_files"]

CORNER_COLUMNS = (
    "picture corner x_px y_px sigma_px residual_x_px residual_y_px used board_x_m board_y_m board_z_m"
)
POSE_COLUMNS = (
    "picture qw qx qy qz px_m py_m pz_m "
    "sigma_rx_rad sigma_ry_rad sigma_rz_rad sigma_px_m sigma_py_m sigma_pz_m rms_px"
)


def export_files(done: CalibratedCamera) -> dict[str, str | bytes]:
    """Names and contents of the files of the folder: the camera in every format that can say its lens."""
    from vision3d.camera_files import formats_for

    camera = done.calibration.camera
    files: dict[str, str | bytes] = {one.file_name: one.text(camera, "camera") for one in formats_for(camera)}
    return files | {"corners.csv": corners_csv(done), "poses.csv": poses_csv(done)}


def corners_csv(done: CalibratedCamera) -> str:
    """One corner a row: where it was seen, how surely, what the camera leaves of it, whether it counted."""
    fit = done.calibration
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(CORNER_COLUMNS.split())
    for k, view in enumerate(fit.views):
        table = np.column_stack([view.pixels, done.sigmas[k], fit.residuals[k]])
        for row, corner, used, point in zip(table, view.ids, done.used[k], view.points, strict=True):
            own = [f"{value:.8g}" for value in row]
            out.writerow([view.name, corner, *own, int(used), *(f"{value:.9g}" for value in point)])
    return text.getvalue()


def poses_csv(done: CalibratedCamera) -> str:
    """One picture a row: pose of the board in the camera's frame and its standard deviations."""
    fit = done.calibration
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(POSE_COLUMNS.split())
    for k, view in enumerate(fit.views):
        sigmas = np.sqrt(np.diag(fit.pose_covs[k]))
        out.writerow(
            [view.name, *(f"{value:.9g}" for value in (*fit.poses[k], *sigmas)), f"{fit.view_rms[k]:.5f}"]
        )
    return text.getvalue()
