"""Mahony's filter of the firmware."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, final

from sequential.attitude.mahony import Mahony
from sequential.firmware.filters import FirmwareFilter, FixedPointFilter

__all__ = ["CMahony", "CMahonyFixed"]


@final
@dataclass(frozen=True)
class CMahony(FirmwareFilter):
    """`Mahony` in C, single precision: firmware/core/mahony_f32.c, as the Cortex-M4 runs it.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where `design` says nothing and the recording has one
    design : its settings

    Notes
    -----
    State (20,) of `start` and `step`: that of `Mahony`.
    """

    design: Mahony = field(default_factory=Mahony)

    ENTRY: ClassVar[str] = "mahony_f32"
    FIELDS: ClassVar[tuple[str, ...]] = (
        "gain", "heading_gain", "integral_gain", "bias_limit", "error_limit", "lasting_time", "heading_gate",
        "heading_timeout", "start_gain", "start_time", "rest_gyro", "rest_accel", "rest_time",
        "rest_constant", "tilt_by_field", "order",
    )  # fmt: skip
    KNOWS: ClassVar[tuple[str, ...]] = ("world_q_body", "gyro_bias", "rest", "magnetic_disturbance")
    SHARES_STATE: ClassVar[bool] = True

    @property
    def reference(self) -> Mahony:
        """The Python filter."""
        return self.design


@final
@dataclass(frozen=True)
class CMahonyFixed(FixedPointFilter):
    """`Mahony` in fixed point: firmware/core/mahony_q.c, the same bits on this machine, an M4 and an AVR.

    Without a magnetometer it is the 6-D filter of the boards, with one that of firmware/core/mahony_q9.c.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where `design` says nothing and the recording has one
    rate : nominal samples a second; None for those of the recording, or, sample by sample, 100
    design : its settings; `tilt_by_field` is not used, and the order is 3

    Notes
    -----
    State (n,) of `start` and `step`: the quaternion, then the C struct as it lies in memory.
    """

    design: Mahony = field(default_factory=Mahony)

    ENTRY: ClassVar[str] = "mahony_q"
    FIELDS: ClassVar[tuple[str, ...]] = (
        "gain", "integral_gain", "bias_limit", "error_limit", "lasting_time", "start_gain", "start_time",
        "rest_gyro", "rest_accel", "rest_time", "rest_constant",
        "heading_gain", "heading_gate", "heading_timeout",
    )  # fmt: skip
    KNOWS: ClassVar[tuple[str, ...]] = ("world_q_body", "gyro_bias", "rest", "magnetic_disturbance")

    @property
    def reference(self) -> Mahony:
        """The Python filter."""
        return self.design
