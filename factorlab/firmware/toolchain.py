"""Compilers and emulators of the boards: found on the path, or named with the Debian package to install."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

from sequential.errors import ToolMissingError
from sequential.firmware import source_folder

__all__ = [
    "MACHINE",
    "PACKAGES",
    "PLAIN",
    "TARGETS",
    "firmware_folder",
    "missing_tools",
    "mps2",
    "require_tools",
    "run_tool",
]

# flags of the compilers, as in the Makefiles of firmware/ports; the M4's tuning makes GCC take vmla, a
# product and a sum with both their roundings: still the host's bits
MACHINE = {
    "m4": (
        "-mcpu=cortex-m4", "-mtune=cortex-r5", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16",
        "-fno-math-errno",
    ),
    "avr": ("-mmcu=atmega328p", "-DF_CPU=16000000UL"),
}  # fmt: skip
PLAIN = ("-std=c99", "-Wall", "-Wextra", "-ffp-contract=off", "-ffunction-sections", "-fdata-sections")
# command: Debian package that brings it
PACKAGES = {
    "make": "make",
    "gcc": "gcc",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi",
    "arm-none-eabi-size": "binutils-arm-none-eabi",
    "qemu-system-arm": "qemu-system-arm",
    "avr-gcc": "gcc-avr",
    "avr-size": "binutils-avr",
    "simavr": "simavr",
}
# a package of headers only: the compiler that is asked for one of them
HEADERS = {
    "avr-libc": (("avr-gcc", "-mmcu=atmega328p"), "avr/io.h"),
    "libsimavr-dev": (("gcc",), "simavr/sim_avr.h"),
    "libelf-dev": (("gcc",), "libelf.h"),
    "libnewlib-arm-none-eabi": (("arm-none-eabi-gcc",), "string.h"),
}
# what building for a target and running it here take
TARGETS = {
    "m4": (
        ("make", "arm-none-eabi-gcc", "arm-none-eabi-size", "libnewlib-arm-none-eabi"),
        ("qemu-system-arm",),
    ),
    "avr": (("make", "avr-gcc", "avr-size", "avr-libc"), ("gcc", "simavr", "libsimavr-dev", "libelf-dev")),
}


def missing_tools(target: str, *, emulate: bool = False) -> tuple[str, ...]:
    """Debian packages that building for a target (and running the image) needs and that are not here."""
    build, run = TARGETS[target]
    return tuple(name for wanted in (*build, *(run if emulate else ())) if (name := _package(wanted)))


def require_tools(target: str, *, emulate: bool = False) -> None:
    """Raise unless everything is here.

    Raises
    ------
    ToolMissingError
        one sentence with the packages to install.
    """
    if lacking := missing_tools(target, emulate=emulate):
        what = "building and emulating" if emulate else "building"
        raise ToolMissingError(
            f"{what} for {target} needs what is not installed here: apt install {' '.join(lacking)}"
        )


def firmware_folder() -> Path:
    """The folder `firmware` with core, application and ports.

    Raises
    ------
    ToolMissingError
        where this installation has none.
    """
    folder = source_folder()
    if folder is None:
        raise ToolMissingError("there are no firmware sources here: install factorlab from its repository")
    return folder


def run_tool(command: list[str], *, cwd: Path | None = None, what: str = "", path: str | None = None) -> str:
    """Run a compiler or an emulator; its output.

    Parameters
    ----------
    command : its first word is looked for on the path
    what : what is being done, for the message
    path : folders to look in instead

    Raises
    ------
    ToolMissingError
        where it is missing or fails, with the line that says why.
    """
    program = shutil.which(command[0], path=path)
    if program is None:
        package = PACKAGES.get(command[0], command[0])
        raise ToolMissingError(f"{command[0]} is not installed: apt install {package}")
    done = subprocess.run(  # noqa: S603 - commands of this package, on files of the user
        [program, *command[1:]], cwd=cwd, capture_output=True, text=True, check=False
    )
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        reason = next((line for line in lines if "error" in line.lower()), lines[-1])
        raise ToolMissingError(f"{what or command[0]} failed: {reason}")
    return done.stdout


def mps2(image: Path, words: Iterable[str]) -> list[str]:
    """QEMU's command for an image and its arguments; all but the serial line and the time."""
    arguments = ",".join(f"arg={word}" for word in words)
    return [
        "qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-monitor", "none",
        "-semihosting-config", f"enable=on,target=native,{arguments}", "-kernel", str(image.resolve()),
    ]  # fmt: skip


def _package(wanted: str) -> str:
    """The package that is lacking for a command or a header; empty where it is here."""
    if wanted in PACKAGES:
        return "" if shutil.which(wanted) else PACKAGES[wanted]
    compiler, header = HEADERS[wanted]
    if shutil.which(compiler[0]) is None:
        return wanted
    asked = subprocess.run(  # noqa: S603 - a compiler named above
        [*compiler, "-E", "-xc", "-"],
        input=f"#include <{header}>\n",
        capture_output=True,
        text=True,
        check=False,
    )
    return wanted if asked.returncode else ""
