"""Compile the C core of `firmware/` into one shared object: `python -m sequential.firmware`.

Only the standard library is imported here, because the installation runs this file on its own.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

__all__ = ["FLAGS", "compile_core", "find_compiler", "library_path", "source_folder", "sources"]

# the arithmetic of the boards: no fused multiply-add, nothing reordered, no instruction of this machine only
FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-shared", "-Wall", "-Wextra")
PARTS = ("core", "binding")
HERE = Path(__file__).resolve().parent


def source_folder() -> Path | None:
    """The folder `firmware`: of the checkout around this file, else the copy in the installed package."""
    for folder in (HERE.parents[1] / "firmware", HERE / "sources"):
        if (folder / "core").is_dir():
            return folder
    return None


def sources(folder: Path) -> list[Path]:
    """Every C file of the shared object, in a fixed order."""
    return [path for part in PARTS for path in sorted((folder / part).glob("*.c"))]


def library_path() -> Path:
    """Where the shared object of this Python lies, whether or not it is there."""
    return HERE / f"_core{sysconfig.get_config_var('EXT_SUFFIX') or '.so'}"


def find_compiler() -> str | None:
    """$CC where it is set, else gcc, cc or clang."""
    wanted = os.environ.get("CC", "").split()
    return next(
        (found for name in (*wanted[:1], "gcc", "cc", "clang") if (found := shutil.which(name))), None
    )


def compile_core(folder: Path, target: Path) -> Path:
    """Compile the sources in `folder` into `target`; what was there stays until the new one is whole.

    Raises
    ------
    RuntimeError
        where there is no compiler, or where it refuses.
    """
    compiler = find_compiler()
    if compiler is None:
        raise RuntimeError("there is no C compiler: install one (Debian: apt install gcc), or set CC")
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".core-", dir=target.parent) as scratch:
        made = Path(scratch) / target.name
        files = [str(path) for path in sources(folder)]
        command = [compiler, *FLAGS, f"-I{folder / 'core'}", *files, "-o", str(made), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own files
        if done.returncode:
            raise RuntimeError(f"{compiler} refused the C core of {folder}: {_first_error(done.stderr)}")
        made.replace(target)
    return target


def _first_error(said: str) -> str:
    lines = said.strip().splitlines()
    return next((line for line in lines if "error:" in line), lines[-1] if lines else "no message")


def main() -> int:
    """Compile in place and say where."""
    folder = source_folder()
    if folder is None:
        sys.stderr.write("error: this installation has no firmware sources beside it\n")
        return 1
    try:
        made = compile_core(folder, library_path())
    except (RuntimeError, OSError) as error:
        sys.stderr.write(f"error: {error}\n")
        return 1
    sys.stdout.write(f"{made}\n")
    return 0
