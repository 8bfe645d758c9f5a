"""What a filter of `firmware/core` takes on a target: code and constants, state, worst-case stack."""

from __future__ import annotations

import functools
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from factorlab.firmware.stack import call_graph, deepest, frames
from factorlab.firmware.toolchain import MACHINE, PLAIN, firmware_folder, require_tools, run_tool

__all__ = ["Sizes", "module_sizes"]

STRICT = (*PLAIN, "-fstack-usage")
ALONE = ("-nostartfiles", "--specs=nano.specs", "--specs=nosys.specs", "-Wl,-e,main")
# compiler and its tools, what links without a port around it
TARGETS = {"m4": ("arm-none-eabi-", ALONE), "avr": ("avr-", ())}
KEPT = r"^ \.(?:text|rodata|progmem|data)[.\w]*\s+0x([0-9a-f]+)\s+0x([0-9a-f]+)\s+(\S+\.o)$"
PLACED = re.compile(KEPT, re.MULTILINE)


@dataclass(frozen=True)
class Sizes:
    """Bytes of one filter on one target.

    Attributes
    ----------
    text : code and constants of start, step and attitude, without what runs once (defaults, derive)
    state : the struct that changes with every sample
    derived : the struct of constants that the step reads
    stack : of the deepest path from the step
    path : that path
    """

    text: int
    state: int
    derived: int
    stack: int
    path: tuple[str, ...]


def module_sizes(
    module: str,
    target: str,
    *,
    optimize: str = "-O2",
    step: str | None = None,
    state: str | None = None,
) -> Sizes:
    """Compile a module for a target and measure it.

    Parameters
    ----------
    module : a filter of `firmware/core` with its suffix, such as "mahony_q"
    target : "m4" or "avr"
    optimize : flag of the compiler
    step, state : names, where the module departs from `<module>_step` and `<module>_state`

    Raises
    ------
    ToolMissingError
        where the compiler is missing, or refuses.
    """
    require_tools(target)
    prefix, link = TARGETS[target]
    step, state = step or f"{module}_step", state or f"{module}_state"
    built = _objects(target, optimize)
    with tempfile.TemporaryDirectory(prefix="factorlab-sizes-") as name:
        folder = Path(name)
        (folder / "stub.c").write_text(_stub(module, step, state), encoding="utf-8")
        run_tool([*built.compiler, "-c", "stub.c"], cwd=folder, what=f"compiling {module} for {target}")
        ours = [str(path) for path in sorted(built.folder.glob("*.o"))]
        links = [*built.compiler, *link, "-Wl,--gc-sections", "-Wl,-Map=stub.map", "stub.o", *ours, "-lm"]
        run_tool([*links, "-o", "stub.elf"], cwd=folder, what=f"linking {module} for {target}")
        text = _text((folder / "stub.map").read_text(encoding="utf-8"), built.folder)
        of_state, of_derived = _struct_sizes(run_tool([f"{prefix}nm", "-S", "stub.o"], cwd=folder))
        calls, pushes = call_graph(run_tool([f"{prefix}objdump", "-d", "stub.elf"], cwd=folder))
    depth, path = deepest(step, calls, frames(built.folder), pushes)
    return Sizes(text, of_state, of_derived, depth, path)


class _Objects(NamedTuple):
    """The core compiled for a target; the folder goes with the process."""

    folder: Path
    compiler: tuple[str, ...]
    held: tempfile.TemporaryDirectory[str]


@functools.cache
def _objects(target: str, optimize: str) -> _Objects:
    prefix, _ = TARGETS[target]
    core = firmware_folder() / "core"
    compiler = (f"{prefix}gcc", *STRICT, *MACHINE[target], optimize, f"-I{core}")
    held = tempfile.TemporaryDirectory(prefix="factorlab-core-")
    sources = [str(path) for path in sorted(core.glob("*.c"))]
    run_tool([*compiler, "-c", *sources], cwd=Path(held.name), what=f"compiling the core for {target}")
    return _Objects(Path(held.name), compiler, held)


def _stub(module: str, step: str, state: str) -> str:
    """A program that needs what a running filter needs, and objects as large as its structs."""
    suffix = "q" if module.endswith("_q") else "f32"
    number, time = ("int32_t", "uint8_t") if suffix == "q" else ("float", "float")
    return f"""
#include "{module}.h"
struct {state} own_state;
struct {module}_derived own_derived;
static struct imu_{suffix} sample;
static {number} attitude[4];
volatile {time} elapsed;
int main(void)
{{
    {module}_start(&own_state, &own_derived, &sample);
    for (;;) {{
        {step}(&own_state, &own_derived, &sample, elapsed);
        {module}_attitude(&own_state, attitude);
    }}
}}
"""


def _text(linker_map: str, built: Path) -> int:
    """Bytes of code and constants of the core that the linker kept; the others stand at 0."""
    placed = PLACED.findall(linker_map)
    return sum(
        int(size, 16) for address, size, place in placed if int(address, 16) and Path(place).parent == built
    )


def _struct_sizes(symbols: str) -> tuple[int, int]:
    sizes = {}
    for line in symbols.splitlines():
        parts = line.split()
        if len(parts) == 4:
            sizes[parts[3]] = int(parts[1], 16)
    return sizes["own_state"], sizes["own_derived"]
