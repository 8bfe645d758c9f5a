"""The complementary filter of the firmware."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, final

from sequential.attitude.complementary import ComplementaryAttitude
from sequential.firmware.filters import FirmwareFilter

__all__ = ["CComplementary"]


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
    def name(self) -> str:
        """c-complementary."""
        return "c-complementary"

    @property
    def reference(self) -> ComplementaryAttitude:
        """The Python filter."""
        return self.design
