"""Noise that a user has declared in a filter, to be held against what the sensor shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path

from factorlab.characterize.channels import Channel
from sequential.errors import DataError
from sequential.noise import ImuNoise

__all__ = ["Declared", "read_noise"]


@dataclass(frozen=True, slots=True)
class Declared:
    """Declared noise.

    Parameters
    ----------
    sigmas : standard deviation of a reading, by channel, group, or "" for every channel; unit of the readings
    noise : densities and bias walks of an IMU, as a filter takes them; None where none were given
    """

    sigmas: Mapping[str, float] = field(default_factory=dict)
    noise: ImuNoise | None = None

    @classmethod
    def of(
        cls, variances: Mapping[str, float], sigmas: Mapping[str, float], noise: ImuNoise | None = None
    ) -> Declared:
        """From variances (R) and standard deviations; a name may not be in both.

        Raises
        ------
        DataError
        """
        if both := [name for name in variances if name in sigmas]:
            raise DataError(f"both R and σ are given for {both[0] or 'every axis'}; give one of them")
        for name, value in {**variances, **sigmas}.items():
            if not 0.0 < value < float("inf"):
                raise DataError(f"declared noise of {name or 'every axis'} is {value:g}; it must be positive")
        return cls({**{name: value**0.5 for name, value in variances.items()}, **sigmas}, noise)

    def require_known(self, channels: tuple[Channel, ...]) -> None:
        """Raise `DataError` where a name is that of no channel, or one number is for several units."""
        names = list(dict.fromkeys([c.name for c in channels] + [c.group for c in channels]))
        for name in self.sigmas:
            if name and name not in names:
                near = get_close_matches(name, names, n=1)
                hint = f"; did you mean {near[0]!r}?" if near else ""
                raise DataError(f"noise is declared for {name!r}; there are {', '.join(names)}{hint}")
        units = list(dict.fromkeys(f"{c.group} in {c.unit or '?'}" for c in channels))
        if "" in self.sigmas and len(units) > 1:
            raise DataError(
                f"one noise is declared for {' and '.join(units)}; say which: {channels[0].group}=VALUE"
            )

    def sigma_of(self, channel: Channel) -> float | None:
        """Declared standard deviation of a reading, the most particular name first; None without one."""
        for name in (channel.name, channel.group, ""):
            if name in self.sigmas:
                return self.sigmas[name]
        return None


def read_noise(path: Path) -> ImuNoise:
    """Noise densities from Kalibr's `imu.yaml`.

    Raises
    ------
    DataError, FileFormatError
    """
    from sequential.readers import read_kalibr_imu

    return read_kalibr_imu(path).noise
