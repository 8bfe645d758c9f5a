"""Whether an emulated board sends what the same application sends on this computer, bit for bit."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from factorlab.firmware.build import Image, build, filters_of
from factorlab.firmware.emulation import Counts, Emulation
from factorlab.firmware.recorded import build_host, frames_unlike, run_host
from factorlab.firmware.toolchain import TARGETS, missing_tools

__all__ = ["TargetParity", "emulate", "every_target", "target_parity"]


@dataclass(frozen=True, slots=True)
class TargetParity:
    """One filter on one emulated board beside this computer.

    Parameters
    ----------
    filter, target : such as "mahony_q" on "avr"
    samples : compared
    differing : of them; None where nothing could be compared
    lacking : Debian packages that are missing for it
    """

    filter: str
    target: str
    samples: int
    differing: int | None
    lacking: tuple[str, ...] = ()

    @property
    def passed(self) -> bool | None:
        """Whether every bit agrees; None where nothing could be compared."""
        return None if self.differing is None else self.differing == 0


def every_target(counts: Counts, *, floats: bool = True) -> tuple[TargetParity, ...]:
    """Compare every filter in fixed point on both boards, and those in single precision on the M4.

    Parameters
    ----------
    counts : (N, 7) int16, as from `mpu6050_counts`
    floats : also in single precision, which on an AVR is another libm's
    """
    pairs = [(name, target) for target in TARGETS for name in filters_of(target)]
    return tuple(
        target_parity(name, target, counts)
        for name, target in pairs
        if name.endswith("_q") or (floats and target == "m4" and name.endswith("_f32"))
    )


def target_parity(name: str, target: str, counts: Counts) -> TargetParity:
    """Run one filter on an emulated board and here; quaternion, bias and status of every frame must agree."""
    if lacking := missing_tools(target, emulate=True):
        return TargetParity(name, target, len(counts), None, lacking)
    with tempfile.TemporaryDirectory(prefix="factorlab-parity-") as scratch:
        image = build(target, Path(scratch, target), filter=name)
        emulation = emulate(image, counts)
        host = run_host(build_host(Path(scratch, "host"), filter=name), counts)
    return TargetParity(name, target, len(counts), emulation.lost + frames_unlike(emulation, host))


def emulate(image: Image, counts: Counts, mode: str = "q") -> Emulation:
    """Run an image in the emulator of its target; see `emulate_avr` and `emulate_m4`."""
    if image.target == "avr":
        from factorlab.firmware.avr import emulate_avr

        return emulate_avr(image.path, counts, mode=mode)
    from factorlab.firmware.m4 import emulate_m4

    return emulate_m4(image.path, counts, mode=mode)
