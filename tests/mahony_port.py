"""What the tests of the fixed-point Mahony filter share: its state, its sources, still samples."""

import numpy as np
from core_library import samples_q

STATE = [("q", "<i4", 4), ("bias", "<i4", 3), ("gyro_low", "<i4", 3), ("accel_low", "u1", (3, 3)),
         ("lasting", "u1", (2, 3)), ("turn_left", "u1", 3), ("status", "u1"), ("start_left", "<u2"),
         ("still", "<u2")]  # fmt: skip
SETTINGS = (
    "gain", "integral_gain", "bias_limit", "error_limit", "lasting_time", "start_gain", "start_time",
    "rest_gyro", "rest_accel", "rest_time", "rest_constant",
)  # fmt: skip
SOURCES = ("mahony_q_start.c", "mahony_q_derive.c", "mahony_q_update.c", "turning_q.c")
G = 9.80665


def still(count, gyro=(0.0, 0.0, 0.0), accel=(0.0, 0.0, G)):
    """Samples (N,) that say the same."""
    return samples_q(np.tile(gyro, (count, 1)), np.tile(accel, (count, 1)))
