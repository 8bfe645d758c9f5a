"""An orientation as text: a table for a spreadsheet, and the TUM format for evo."""

from __future__ import annotations

import io

import numpy as np

from sequential.attitude import AttitudeHistory

__all__ = ["orientation_csv", "orientation_tum"]


def orientation_csv(history: AttitudeHistory) -> str:
    """Seconds, quaternion, angles in degrees, and whatever else the estimator knows, one row a sample."""
    columns = {"t_s": history.t * 1e-9}
    columns |= dict(zip(("qw", "qx", "qy", "qz"), history.world_q_body.T, strict=True))
    angles = np.degrees(history.roll_pitch_yaw())
    columns |= dict(zip(("roll_deg", "pitch_deg", "yaw_deg"), angles.T, strict=True))
    if (sigmas := history.roll_pitch_yaw_sigmas()) is not None:
        names = ("sigma_roll_deg", "sigma_pitch_deg", "sigma_yaw_deg")
        columns |= dict(zip(names, np.degrees(sigmas).T, strict=True))
    if history.gyro_bias is not None:
        names = ("bias_x_rad_s", "bias_y_rad_s", "bias_z_rad_s")
        columns |= dict(zip(names, history.gyro_bias.T, strict=True))
    for name in ("rest", "magnetic_disturbance"):
        if (flags := getattr(history, name)) is not None:
            columns[name] = flags.astype(np.float64)
    text = io.StringIO()
    forms = ["%.9f" if name == "t_s" else "%d" if name in FLAGS else "%.8g" for name in columns]
    np.savetxt(
        text,
        np.column_stack(list(columns.values())),
        fmt=forms,
        delimiter=",",
        header=",".join(columns),
        comments="",
    )
    return text.getvalue()


FLAGS = {"rest", "magnetic_disturbance"}


def orientation_tum(history: AttitudeHistory) -> str:
    """`t x y z qx qy qz qw` with positions of zero, one line a sample."""
    text = io.StringIO()
    zero = np.zeros((len(history), 3))
    rows = np.column_stack([history.t * 1e-9, zero, history.world_q_body[:, [1, 2, 3, 0]]])
    np.savetxt(text, rows, fmt=["%.9f", *["%g"] * 3, *["%.9f"] * 4])
    return text.getvalue()
