"""Images for the boards, built by the ports' own Makefiles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from factorlab.firmware.toolchain import firmware_folder, require_tools, run_tool
from sequential.errors import DataError
from sequential.sensors import ImuCalibration

__all__ = ["BOARDS", "DEFAULT_FILTER", "FLASH", "Image", "build", "constants_header", "filters_of"]

# by target: the folder of its Makefile, and the tool that measures what it makes
PORTS = {"m4": ("ports/cortex_m4", "arm-none-eabi-size"), "avr": ("ports/avr", "avr-size")}
# by target: boards that the Makefile knows, the emulated one first
BOARDS = {"m4": ("qemu", "stm32f4"), "avr": ("atmega328p",)}
DEFAULT_FILTER = {"m4": "mahony_f32", "avr": "mahony_q"}
# bytes of flash and RAM
FLASH = {"atmega328p": (32768, 2048), "stm32f4": (262144, 65536), "qemu": (4194304, 4194304)}


@dataclass(frozen=True, slots=True)
class Image:
    """A program for a board.

    Parameters
    ----------
    path : the ELF file
    target, board, filter : what it was built for
    text, data, bss : bytes; flash takes text and data, RAM data and bss
    map : the linker's map
    make : the command that built it; with `flash` behind, it writes the image to a board
    """

    path: Path
    target: str
    board: str
    filter: str
    text: int
    data: int
    bss: int
    map: Path
    make: tuple[str, ...]

    @property
    def flash(self) -> int:
        """Bytes of flash."""
        return self.text + self.data

    @property
    def ram(self) -> int:
        """Bytes of RAM that are taken before the program runs; the stack comes on top."""
        return self.data + self.bss


def filters_of(target: str) -> tuple[str, ...]:
    """Filters that an image for a target can carry, the default first."""
    names = sorted(
        path.stem.removeprefix("filter_") for path in (firmware_folder() / "app").glob("filter_*.c")
    )
    default = DEFAULT_FILTER[target]
    return (default, *(name for name in names if name != default and _fits(name, target)))


def _fits(name: str, target: str) -> bool:
    """The error-state filter is for processors with a floating-point unit."""
    return target != "avr" or not name.startswith("error_state")


def build(
    target: str,
    out: Path,
    *,
    filter: str | None = None,  # noqa: A002 - the word of the Makefiles
    board: str | None = None,
    calibration: ImuCalibration | None = None,
) -> Image:
    """Build an image into a folder.

    Parameters
    ----------
    target : "m4" or "avr"
    out : folder of objects, image and constants; it may hold those of an earlier build
    filter : module of firmware/core, such as "mahony_q"; the target's default unless given
    board : one of BOARDS; the emulated one unless given
    calibration : constants from counts to SI, compiled in; those of the data sheet unless given

    Raises
    ------
    DataError
        where there is no such target, filter or board, or the calibration is not one from counts.
    ToolMissingError
        where a compiler is missing, or stops.
    """
    if target not in PORTS:
        raise DataError(f"there is no target {target!r}; there are {', '.join(PORTS)}")
    filter, board = filter or DEFAULT_FILTER[target], board or BOARDS[target][0]  # noqa: A001 - as above
    for given, known, what in ((filter, filters_of(target), "filter"), (board, BOARDS[target], "board")):
        if given not in known:
            raise DataError(f"there is no {what} {given!r} for {target}; there are {', '.join(known)}")
    require_tools(target)
    folder, size = PORTS[target]
    out = out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    options = [f"OUT={out}", f"FILTER={filter}"]
    if target == "m4":
        options.append(f"BOARD={board}")
    if calibration is not None:
        options.append(f"CALIBRATION={constants_header(calibration, out)}")
    make = ["make", "-C", str(firmware_folder() / folder), *options]
    run_tool([*make, "-j2", "--no-print-directory"], what=f"building {filter} for {board}")
    path = out / "firmware.elf"
    text, data, bss = _sizes(run_tool([size, str(path)]))
    return Image(path, target, board, filter, text, data, bss, path.with_suffix(".map"), tuple(make))


def constants_header(calibration: ImuCalibration, folder: Path) -> Path:
    """Write the constants as C into a folder; the file.

    Raises
    ------
    DataError
        where a sensor was calibrated in counts of another range than the driver sets.
    """
    from sequential.sensors import c_header, other_ranges

    for kind, ratio in other_ranges(calibration).items():
        raise DataError(
            f"the {kind} was calibrated in counts of which one is {ratio:.3g} of the firmware's (MPU-6050 at "
            "±8 g, ±2000 °/s): record with those ranges, or calibrate from a recording in SI units"
        )
    path = folder / "calibration.h"
    path.write_text(c_header(calibration), encoding="utf-8")
    return path


def _sizes(said: str) -> tuple[int, int, int]:
    """Text, data and bss of the table that `size` prints."""
    text, data, bss, *_ = said.splitlines()[1].split()
    return int(text), int(data), int(bss)
