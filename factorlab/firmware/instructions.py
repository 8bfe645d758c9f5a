"""How many instructions one update of a firmware filter takes on a Cortex-M4F, counted in QEMU."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.firmware.toolchain import MACHINE, PLAIN, firmware_folder, mps2, require_tools, run_tool
from sequential.errors import DataError, SolverError
from sequential.sensors import ImuRecording

__all__ = ["IMU_F32", "IMU_Q", "InstructionCounts", "count_instructions", "imu_f32", "imu_q"]

COMPILER, EMULATOR = "arm-none-eabi-gcc", "qemu-system-arm"
IMU_F32 = np.dtype([("gyro", "<f4", 3), ("accel", "<f4", 3), ("mag", "<f4", 3)])
IMU_Q = np.dtype([("gyro", "<i4", 3), ("accel", "<i2", 3), ("mag", "<i2", 3)])
FLAGS = (*MACHINE["m4"], *PLAIN, "-Wdouble-promotion")
LINK = (
    "-nostartfiles", "-Wl,--gc-sections", "--specs=nano.specs", "--specs=nosys.specs",
)  # fmt: skip
PLACED = re.compile(r"^ \.(?:text|rodata)(\S*)\s+0x([0-9a-f]+)\s+0x([0-9a-f]+)\s+(\S+\.o)$", re.MULTILINE)
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class InstructionCounts:
    """What an image said of a filter, an entry an update.

    Attributes
    ----------
    instructions : (N,) of each update, without the call itself
    world_q_body : (N, 4) attitude after it, as floats
    raw : (N, 4) the same as the target holds it: float32, or int32 in Q30
    text : bytes of code that the linker kept, a function of `firmware/core` as `file.function`
    """

    instructions: Integers
    world_q_body: NDArray[np.float64]
    raw: NDArray[np.float32] | NDArray[np.int32]
    text: Mapping[str, int]

    @property
    def mean(self) -> float:
        """Instructions an update, on average."""
        return float(self.instructions.mean())

    @property
    def worst(self) -> int:
        """Instructions of the longest update."""
        return int(self.instructions.max())


def imu_f32(recording: ImuRecording) -> NDArray[np.void]:
    """(N,) samples of `struct imu_f32`; without a magnetometer its field is NaN."""
    recording.require("gyro", "accel")
    samples = np.zeros(len(recording), IMU_F32)
    samples["gyro"], samples["accel"] = recording.gyro, recording.accel
    samples["mag"] = np.nan if recording.mag is None else recording.mag
    return samples


def imu_q(recording: ImuRecording) -> NDArray[np.void]:
    """(N,) samples of `struct imu_q`, rounded and saturated; without a magnetometer its field is 0."""
    recording.require("gyro", "accel")
    samples = np.zeros(len(recording), IMU_Q)
    for sensor, bits, low, high in (("gyro", 24, -(2**31), 2**31 - 1), ("accel", 8, -(2**15), 2**15 - 1)):
        samples[sensor] = np.clip(np.rint(getattr(recording, sensor) * 2.0**bits), low, high)
    if recording.mag is not None:
        samples["mag"] = np.clip(np.rint(np.nan_to_num(recording.mag) * 2.0**8), -(2**15), 2**15 - 1)
    return samples


def count_instructions(
    module: str,
    samples: NDArray[np.void],
    *,
    rate: float = 100.0,
    step: str | None = None,
    names: Mapping[str, str] | None = None,
    optimize: str = "-O2",
    header: Path | None = None,
) -> InstructionCounts:
    """Run a filter of `firmware/core` over samples on an emulated Cortex-M4F, counting every update.

    Parameters
    ----------
    module : its name with the suffix, `"mahony_f32"`
    samples : (N,) of dtype `IMU_F32` or `IMU_Q`, as the suffix asks for
    rate : samples a second
    step : name of the function to count; `<module>_step` by default
    names : other names where the module departs from the pattern, of STATE, DERIVED, SETTINGS, DEFAULTS,
        DERIVE, START and ATTITUDE
    optimize : flag of the compiler
    header : of a module elsewhere, with its sources beside it; by default `firmware/core/<module>.h`

    Raises
    ------
    DataError
        where the samples are not of the module's kind.
    ToolMissingError
        where compiler or emulator are missing, or refuse the module.
    """
    fixed = module.endswith("_q")
    if samples.dtype != (wanted := IMU_Q if fixed else IMU_F32):
        raise DataError(f"{module} takes samples of dtype {wanted}, got {samples.dtype}")
    require_tools("m4", emulate=True)
    header = header or firmware_folder() / "core" / f"{module}.h"
    with tempfile.TemporaryDirectory() as folder:
        image, source, sink = (Path(folder) / name for name in ("count.elf", "samples", "updates"))
        defined = _defined(module, step, names) | {
            "HEADER": f'"{header}"', "FIXED_POINT": str(int(fixed)), "RATE_HZ": f"{rate:.9g}",
        }  # fmt: skip
        _build(image, header.parent, [f"-D{key}={value}" for key, value in defined.items()], optimize)
        source.write_bytes(samples.tobytes())
        _emulate(image, source, sink)
        component = "<i4" if fixed else "<f4"
        updates = np.frombuffer(sink.read_bytes(), np.dtype([("n", "<u4"), ("q", component, 4)]))
        text = _text(image.with_suffix(".map"), header.parent)
    if len(updates) != len(samples):
        raise SolverError(f"{module} gave {len(updates)} of {len(samples)} updates in {EMULATOR}")
    q = updates["q"].astype(np.float64)
    return InstructionCounts(
        updates["n"].astype(np.int64), q / 2.0**30 if fixed else q, updates["q"].copy(), text
    )


def _defined(module: str, step: str | None, names: Mapping[str, str] | None) -> dict[str, str]:
    usual = {
        key: f"{module}_{key.lower()}"
        for key in ("STATE", "DERIVED", "SETTINGS", "DEFAULTS", "DERIVE", "START", "ATTITUDE")
    }
    return usual | {"STEP": step or f"{module}_step"} | dict(names or {})


def _build(image: Path, core: Path, defined: list[str], optimize: str) -> None:
    firmware = firmware_folder()
    port = firmware / "ports" / "cortex_m4"
    sources = [
        firmware / "check" / "cycles_m4.c", port / "startup.c", port / "qemu" / "semihosting.c",
        *sorted(core.glob("*.c")),
    ]  # fmt: skip
    compiling = [COMPILER, *FLAGS, optimize, *defined, "-c", *map(str, sources)]
    run_tool(compiling, cwd=image.parent, what=f"compiling {core}")
    objects = [source.with_suffix(".o").name for source in sources]
    linking = [
        COMPILER, *FLAGS, *LINK, f"-L{port}", "-T", str(port / "qemu" / "mps2.ld"),
        f"-Wl,-Map={image.with_suffix('.map')}", *objects, "-lm", "-o", str(image),
    ]  # fmt: skip
    run_tool(linking, cwd=image.parent, what=f"linking {core}")


def _emulate(image: Path, source: Path, sink: Path) -> None:
    emulating = mps2(image, [word.name for word in (image, source, sink)])
    emulating += ["-serial", "none", "-icount", "shift=10"]
    run_tool(emulating, cwd=image.parent, what="counting instructions")


def _text(linker_map: Path, core: Path) -> dict[str, int]:
    """Bytes kept of each function and table; what the linker threw away stands at address 0."""
    ours = {source.with_suffix(".o").name for source in core.glob("*.c")}
    kept: dict[str, int] = {}
    for name, address, size, place in PLACED.findall(linker_map.read_text(encoding="utf-8")):
        if int(address, 16) and int(size, 16) and Path(place).name in ours:
            key = f"{Path(place).stem}{name}"
            kept[key] = kept.get(key, 0) + int(size, 16)
    return kept
