"""The tilt Kalman filter of the firmware."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

from sequential.attitude.tilt_kalman import TiltKalman
from sequential.firmware.filters import FirmwareFilter, FixedPointFilter

__all__ = ["CTiltKalman", "CTiltKalmanFixed"]

FIELDS = ("gyro_density", "bias_walk", "tilt_sigma", "heading_sigma", "gate", "bias_sigma")


def tilt_settings(design: TiltKalman) -> NDArray[np.float64]:
    """In the order of FIELDS; the C struct takes the gate on the NIS, not its probability."""
    gate = design.settings[4]
    return np.array([gate if name == "gate" else float(getattr(design, name)) for name in FIELDS])


@final
@dataclass(frozen=True)
class CTiltKalman(FirmwareFilter):
    """`TiltKalman` in C, single precision: firmware/core/tilt_f32.c.

    Parameters
    ----------
    magnetometer : use it for yaw or not; None where `design` says nothing and the recording has one
    design : its settings

    Notes
    -----
    State (19,) of `start` and `step`: that of `TiltKalman`, which begins with angles; the last three numbers,
    rates of the last step, are 0.
    """

    design: TiltKalman = field(default_factory=TiltKalman)

    ENTRY: ClassVar[str] = "tilt_f32"
    FIELDS: ClassVar[tuple[str, ...]] = FIELDS
    KNOWS: ClassVar[tuple[str, ...]] = ("world_q_body", "gyro_bias")
    SHARES_STATE: ClassVar[bool] = True

    @property
    def reference(self) -> TiltKalman:
        """The Python filter."""
        return self.design

    @property
    def settings(self) -> NDArray[np.float64]:
        """What the binding takes, in the order of FIELDS."""
        return tilt_settings(self.design)


@final
@dataclass(frozen=True)
class CTiltKalmanFixed(FixedPointFilter):
    """`TiltKalman` in fixed point: firmware/core/tilt_q.c, the same bits on this machine, an M4 and an AVR.

    Parameters
    ----------
    magnetometer : use it for yaw or not; None where `design` says nothing and the recording has one
    rate : nominal samples a second; None for those of the recording, or, sample by sample, 100
    design : its settings
    bias_limit : the biases stay within ± this, rad/s; `TiltKalman` has no limit

    Notes
    -----
    State (n,) of `start` and `step`: the quaternion, then the C struct as it lies in memory.
    """

    design: TiltKalman = field(default_factory=TiltKalman)
    bias_limit: float = 1.0

    ENTRY: ClassVar[str] = "tilt_q"
    FIELDS: ClassVar[tuple[str, ...]] = (*FIELDS, "bias_limit")
    KNOWS: ClassVar[tuple[str, ...]] = ("world_q_body", "gyro_bias")

    @property
    def reference(self) -> TiltKalman:
        """The Python filter."""
        return self.design

    @property
    def settings(self) -> NDArray[np.float64]:
        """What the binding takes, in the order of FIELDS."""
        return np.append(tilt_settings(self.design), self.bias_limit)
