"""Every file of the core compiles without a warning on every compiler, and needs nothing it may not."""

import re
import subprocess

import pytest
from c_structs import CORE, WARNINGS

SOURCES = sorted(CORE.glob("*.c"))
HEADERS = sorted(CORE.glob("*.h"))
ALONE = [one for one in HEADERS if not one.stem.endswith("_avr")]
"""Headers that a user includes; the others are parts of one."""
FLAGS = ("-std=c99", *WARNINGS, "-ffp-contract=off", f"-I{CORE}")
TARGETS = {
    "host": ("c_compiler", ("-O2",)),
    "clang": ("clang", ("-O2",)),
    "m4": (
        "arm_toolchain",
        ("-O2", "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-fno-math-errno"),
    ),
    "avr": ("avr_toolchain", ("-O2", "-mmcu=atmega328p")),
    "avr for size, as Arduino's": ("avr_toolchain", ("-Os", "-mmcu=atmega328p")),
}
ALLOWED = re.compile(
    r"^(memcpy|memset|memcmp|memmove|sqrtf|__aeabi_mem\w+|__aeabi_[ui]?ldivmod|__aeabi_lmul|__aeabi_ll[sla]\w+"
    r"|__aeabi_[uf]?2?\w*l2f|__aeabi_f2u?lz)$"
)
"""What the core takes from outside on the M4: memory, square roots, long integers; nothing of double."""


@pytest.fixture(params=TARGETS, name="compile_core")
def a_compiler(request):
    """A function that compiles one file with one compiler."""
    fixture, own = TARGETS[request.param]
    compiler = request.getfixturevalue(fixture)

    def compile_core(source, target, *more):
        done = subprocess.run(
            [compiler, *FLAGS, *own, *more, "-c", str(source), "-o", str(target)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stderr

    return compile_core


def test_no_file_warns(compile_core, tmp_path):
    assert SOURCES
    said = {one.name: compile_core(one, tmp_path / f"{one.stem}.o") for one in SOURCES}
    assert not {name: words for name, words in said.items() if words}


def test_every_header_stands_alone_in_c(c_compiler, tmp_path):
    for header in ALONE:
        alone = tmp_path / "alone.c"
        alone.write_text(f'#include "{header.name}"\n#include "{header.name}"\nint alone(void);\n')
        command = [c_compiler, *FLAGS, "-O2", "-Wno-unused-function", "-c", str(alone), "-o", "/dev/null"]
        subprocess.run(command, check=True)


def test_every_header_is_taken_by_cpp(cxx_compiler, tmp_path):
    for header in ALONE:
        alone = tmp_path / "alone.cpp"
        alone.write_text(f'#include "{header.name}"\n#include "{header.name}"\nint alone();\n')
        warnings = ("-Wall", "-Wextra", "-Werror", "-Wno-unused-function")
        command = [cxx_compiler, "-std=c++11", *warnings, f"-I{CORE}", "-c", str(alone), "-o", "/dev/null"]
        subprocess.run(command, check=True)


@pytest.fixture(scope="module", name="undefined")
def names_from_outside(arm_toolchain, tmp_path_factory):
    """What each object of the core asks the linker for on the M4."""
    folder = tmp_path_factory.mktemp("m4")
    found = {}
    for source in SOURCES:
        target = folder / f"{source.stem}.o"
        command = [arm_toolchain, *FLAGS, *TARGETS["m4"][1], "-c", str(source), "-o", str(target)]
        subprocess.run(command, check=True)
        listed = subprocess.run(
            [arm_toolchain.replace("gcc", "nm"), str(target)], capture_output=True, text=True, check=True
        ).stdout
        found[source.name] = listed
    return found


def test_nothing_is_computed_in_double_on_the_m4(undefined):
    names = " ".join(undefined.values())
    assert not re.findall(r"__aeabi_(?:d\w+|[a-z]+2d)\b", names)


def test_nothing_of_libm_but_the_square_root_nor_of_malloc(undefined):
    own = {name for listed in undefined.values() for name in re.findall(r" [TDRBVWC] (\w+)", listed)}
    for source, listed in undefined.items():
        asked = set(re.findall(r"^\s+U (\w+)$", listed, flags=re.MULTILINE)) - own
        assert not {name for name in asked if not ALLOWED.match(name)}, source


def test_nothing_of_the_core_keeps_a_state_of_its_own(undefined):
    """All state is the caller's, so that two filters of one kind never meet."""
    for source, listed in undefined.items():
        assert not re.findall(r" [DdBbC] (\w+)", listed), source


@pytest.mark.parametrize("path", [*SOURCES, *HEADERS], ids=lambda path: path.name)
def test_files_keep_the_house_style(path):
    text = path.read_text()
    assert "\t" not in text
    if path.suffix == ".h":
        guard = f"FACTORLAB_{path.stem.upper()}_H"
        assert f"#ifndef {guard}\n#define {guard}\n" in text
    for body in re.findall(
        r"^struct \w+_(?:settings|state|derived) \{\n(.*?)^\};", text, re.DOTALL | re.MULTILINE
    ):
        assert all("/*" in line for line in body.strip().split("\n") if ";" in line), "a unit at every field"
