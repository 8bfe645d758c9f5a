"""The C filters held to the Python ones: one step from an equal state, and a whole recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.evaluate import attitude_error
from sequential.sensors import ImuRecording

__all__ = ["BAR", "BARS", "Parity", "parity", "sampled"]

Array = NDArray[np.float64]
STEPS = 3000  # samples that are stepped one by one
STEEP = np.radians(75.0)
# difference of a step; root mean square and largest angle over a recording, degrees
BAR = (1e-6, 0.1, 0.3)
# its corrections come a sample or two later, which shows while the first ones are large
BARS = {"c-error-state": (1e-6, 0.1, 1.0)}


@dataclass(frozen=True, slots=True, eq=False)
class Parity:
    """One C filter beside its Python model on one recording.

    Parameters
    ----------
    name : of the C filter, as `factorlab attitude --filter` takes it
    recording : its name
    magnetometer : whether it was used
    seconds : (N,) of the samples
    apart : (N,) angle between both attitudes, degrees
    step : difference of a number of the attitude after one step from an equal state, which 999 of 1 000
        steps stay below (where a rounding decides about a threshold, one is larger); None where the states
        differ: in fixed point, and in the error-state filter, which spreads the work of a block over the
        samples after it
    """

    name: str
    recording: str
    magnetometer: bool
    seconds: Array
    apart: Array
    step: float | None = None

    @property
    def fixed(self) -> bool:
        """Whether the filter computes in fixed point."""
        return self.name.endswith("-q")

    @property
    def rms(self) -> float:
        """Root mean square of the angle between both, degrees."""
        return float(np.sqrt(np.mean(self.apart**2)))

    @property
    def worst(self) -> float:
        """Largest angle between both, degrees."""
        return float(self.apart.max())

    @property
    def passed(self) -> bool:
        """Whether all bars are cleared."""
        step, rms, worst = BARS.get(self.name, BAR)
        return (self.step is None or self.step <= step) and self.rms <= rms and self.worst <= worst


def parity(name: str, recording: ImuRecording, *, magnetometer: bool | None = None) -> Parity:
    """Run a C filter and its model on the same samples.

    Of a filter of angles, what counts ends where the pitch comes near 90°: roll and yaw have no values there,
    and a rounding decides over which side they fold.

    Parameters
    ----------
    name : such as "c-mahony"
    recording : in SI; what runs in fixed point on a board is best given the board's rate, see `sampled`
    magnetometer : use it or not; None where the recording has one

    Raises
    ------
    DataError, ToolMissingError
        where there is no such filter, or its core is not compiled.
    """
    from dataclasses import replace

    from factorlab.attitude import make_estimator

    ported = replace(make_estimator(name), magnetometer=magnetometer)
    used = recording.mag is not None and ported.magnetometer is not False
    model = replace(ported.reference, magnetometer=used)
    own, theirs = ported.estimate(recording), model.estimate(recording)
    errors = attitude_error(own.world_q_body, theirs.world_q_body).errors[:, 0]
    if model.name == "kalman":
        steep = np.abs(theirs.roll_pitch_yaw()[:, 1]) > STEEP
        errors = errors[: int(np.argmax(steep)) if steep.any() else None]
    step = _usual_step(ported, model, recording, used=used) if ported.SHARES_STATE else None
    return Parity(name, recording.name, used, recording.seconds[: len(errors)], np.degrees(errors), step)


def _usual_step(ported: Any, model: Any, recording: ImuRecording, *, used: bool) -> float:
    """Step both from the model's state, sample by sample."""
    gyro, accel, mag = model.samples(recording)
    state = model.start(gyro[0], accel[0])
    differences = []
    for k in range(min(len(recording), STEPS)):
        dt = float(recording.t[k] - recording.t[k - 1]) * 1e-9 if k else 0.0
        taken = gyro[k], accel[k], mag[k] if used else None, dt
        following, other = model.step(state, *taken), ported.step(state, *taken)
        differences.append(float(np.abs(following[:4] - other[:4]).max()))
        state = following
    return float(np.quantile(differences, 0.999, method="higher"))


def sampled(recording: ImuRecording, rate: float = 100.0) -> ImuRecording:
    """The recording at the rate of a board, Hz: readings between samples lie on their line."""
    step = round(1e9 / rate)
    t = np.arange(recording.t[0], recording.t[-1] + 1, step)

    def placed(values: Array | None) -> Array | None:
        if values is None:
            return None
        known = np.isfinite(values).all(axis=1)
        at = recording.t[known] - recording.t[0]
        return np.column_stack([np.interp(t - recording.t[0], at, column) for column in values[known].T])

    return ImuRecording(
        t, placed(recording.accel), placed(recording.gyro), placed(recording.mag), name=recording.name
    )
