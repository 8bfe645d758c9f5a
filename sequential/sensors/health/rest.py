"""Is there any rest in a recording?  Biases, gravity and noise are read there."""

from __future__ import annotations

import numpy as np

from sequential.sensors.finding import Finding
from sequential.sensors.recording import SI, ImuRecording
from sequential.sensors.still import window_variance

__all__ = ["rest_findings"]

WINDOW_S = 1.0
STILL = {"gyro": 0.05, "accel": 0.35}  # rad/s and m/s²: the noise of poor sensors, root of the sum of axes


def rest_findings(recording: ImuRecording) -> list[Finding]:
    """A warning where no second of a recording is still, in sensors whose unit is known."""
    count = round(WINDOW_S * recording.rate) if len(recording) > 1 else 0
    if count < 5 or len(recording) < 3 * count:
        return []
    still = np.ones(len(recording), dtype=bool)
    looked = False
    for sensor, bound in STILL.items():
        values = getattr(recording, sensor)
        if values is not None and getattr(recording, f"{sensor}_unit") == SI[sensor]:
            still &= window_variance(values, count) < bound**2
            looked = True
    if still.any() or not looked:
        return []
    what = "the recording moves all the time: not one second of it is still"
    do = "begin with 5 s of rest, so that the gyro's bias and the direction of gravity are known"
    return [Finding("warn", what, do=do)]
