"""The complementary filter of the firmware."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, final

from sequential.attitude.complementary import ComplementaryAttitude
from sequential.firmware.filters import FirmwareFilter, FixedPointFilter

__all__ = ["CComplementary", "CComplementaryFixed"]


@final
@dataclass(frozen=True)
class CComplementary(FirmwareFilter):
    """`ComplementaryAttitude` in C, single precision: firmware/core/complementary_f32.c.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where `design` says nothing and the recording has one
    design : its settings

    Notes
    -----
    State (6,) of `start` and `step`: that of `ComplementaryAttitude`.
    """

    design: ComplementaryAttitude = field(default_factory=ComplementaryAttitude)

    ENTRY: ClassVar[str] = "complementary_f32"
    FIELDS: ClassVar[tuple[str, ...]] = ("time_constant", "heading_time_constant")
    SHARES_STATE: ClassVar[bool] = True

    @property
    def reference(self) -> ComplementaryAttitude:
        """The Python filter."""
        return self.design


@final
@dataclass(frozen=True)
class CComplementaryFixed(FixedPointFilter):
    """`ComplementaryAttitude` in fixed point: firmware/core/complementary_q.c, the same bits everywhere.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where `design` says nothing and the recording has one
    rate : nominal samples a second; None for those of the recording, or, sample by sample, 100
    design : its settings

    Notes
    -----
    State (n,) of `start` and `step`: the quaternion, then the C struct as it lies in memory.
    """

    design: ComplementaryAttitude = field(default_factory=ComplementaryAttitude)

    ENTRY: ClassVar[str] = "complementary_q"
    FIELDS: ClassVar[tuple[str, ...]] = ("time_constant", "heading_time_constant")

    @property
    def reference(self) -> ComplementaryAttitude:
        """The Python filter."""
        return self.design
