"""The error-state filter of the firmware."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, final

from sequential.attitude.error_state import ErrorStateAttitude
from sequential.firmware.filters import FirmwareFilter

__all__ = ["CErrorState"]


@final
@dataclass(frozen=True)
class CErrorState(FirmwareFilter):
    """`ErrorStateAttitude` in C, single precision: firmware/core/error_state_f32.c, for a Cortex-M4.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where `design` says nothing and the recording has one
    design : its settings

    Notes
    -----
    State (n,) of `start` and `step`: the quaternion with magnetometer, then the C struct as it lies in
    memory.
    """

    design: ErrorStateAttitude = field(default_factory=ErrorStateAttitude)

    ENTRY: ClassVar[str] = "error_state_f32"
    FIELDS: ClassVar[tuple[str, ...]] = tuple(
        name for name in ErrorStateAttitude.__dataclass_fields__ if name != "magnetometer"
    )
    KNOWS: ClassVar[tuple[str, ...]] = (
        "world_q_body", "heading_free", "cov", "cov_6d", "gyro_bias", "gyro_bias_cov", "rest",
        "magnetic_disturbance",
    )  # fmt: skip

    @property
    def reference(self) -> ErrorStateAttitude:
        """The Python filter."""
        return self.design
