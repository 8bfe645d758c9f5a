"""The structs of a C header as ctypes, so that a test cannot differ from the header about a layout."""

import ctypes
import re
import subprocess
from pathlib import Path

CORE = Path(__file__).resolve().parents[1] / "firmware" / "core"
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror")
NUMBERS = {
    "float": ctypes.c_float,
    "uint8_t": ctypes.c_uint8,
    "int16_t": ctypes.c_int16,
    "uint16_t": ctypes.c_uint16,
    "int32_t": ctypes.c_int32,
    "uint32_t": ctypes.c_uint32,
    "uint64_t": ctypes.c_uint64,
    "int64_t": ctypes.c_int64,
}


def structs(*headers: str) -> dict[str, type[ctypes.Structure]]:
    """Every struct of these headers of the core, by name; a member may be a struct from before."""
    found: dict[str, type[ctypes.Structure]] = {}
    for header in headers:
        text = re.sub(r"/\*.*?\*/", "", (CORE / header).read_text(), flags=re.DOTALL)
        for name, body in re.findall(r"^struct (\w+) \{(.*?)^\};", text, flags=re.DOTALL | re.MULTILINE):
            fields = [field for line in body.split(";") if line.strip() for field in _fields(line, found)]
            found[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
    return found


def _fields(line: str, known: dict[str, type[ctypes.Structure]]) -> list[tuple[str, type]]:
    kind, names = re.fullmatch(r"\s*(?:struct )?(\w+) ([^;]+)", line, flags=re.DOTALL).groups()
    fields = []
    for one in names.split(","):
        name, sizes = re.fullmatch(r"\s*(\w+)((?:\[\d+\])*)\s*", one).groups()
        ctype = {**NUMBERS, **known}[kind]
        for size in reversed(re.findall(r"\d+", sizes)):
            ctype *= int(size)
        fields.append((name, ctype))
    return fields


def library(compiler: str, folder: Path, *modules: str, flags: tuple[str, ...] = ()) -> ctypes.CDLL:
    """Modules of the core, compiled to a shared library in a folder of the tests, once."""
    target = folder / f"lib{'_'.join(modules)}.so"
    sources = [str(CORE / f"{module}.c") for module in modules]
    if target.exists():
        return ctypes.CDLL(str(target))
    subprocess.run(
        [compiler, "-std=c99", "-O2", *WARNINGS, "-ffp-contract=off", "-fPIC", "-shared", *flags, *sources,
         "-o", str(target), "-lm"],
        check=True,
    )  # fmt: skip
    return ctypes.CDLL(str(target))
