"""The Arduino library: what the builder of Arduino finds, one sketch compiled by its core, and run."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from factorlab.firmware.avr import RECORD, emulate_avr
from factorlab.firmware.toolchain import run_tool
from sequential.readers.serial import decode

ARDUINO = Path("/usr/share/arduino/hardware/arduino/avr")
CORE = (
    "main.cpp", "wiring.c", "wiring_digital.c", "hooks.c", "abi.cpp", "new.cpp", "Print.cpp", "Stream.cpp",
    "HardwareSerial.cpp", "HardwareSerial0.cpp", "WString.cpp",
)  # fmt: skip
# __DECIMAL_DIG__: Debian's avr-gcc 5.4 knows it, its float.h does not give it to C++
BOARD = (
    "-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR",
    "-DDECIMAL_DIG=__DECIMAL_DIG__", "-Os", "-ffunction-sections", "-fdata-sections",
)  # fmt: skip
C, CPP = ("-std=gnu11",), ("-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics")


@pytest.fixture(scope="module")
def arduino_core(avr_toolchain):
    if not (ARDUINO / "cores" / "arduino" / "Arduino.h").is_file():
        pytest.skip("needs the core of Arduino for AVR: install Debian's arduino-core-avr")
    return ARDUINO


@pytest.fixture(scope="module")
def sketch(arduino_core, firmware_dir, tmp_path_factory):
    """The example, linked as the Arduino builder does it."""
    folder = tmp_path_factory.mktemp("sketch")
    wire = arduino_core / "libraries" / "Wire" / "src"
    include = [f"-I{arduino_core / 'cores' / 'arduino'}", f"-I{arduino_core / 'variants' / 'standard'}"]
    include += [f"-I{wire}", f"-I{firmware_dir / 'src'}"]
    theirs = [arduino_core / "cores" / "arduino" / name for name in CORE]
    theirs += [wire / "Wire.cpp", wire / "utility" / "twi.c"]

    def compile_all(compiler, sources, *flags):
        words = [compiler, *BOARD, *include, *flags, "-c", *map(str, sources)]
        run_tool(words, cwd=folder, what=f"compiling {sources[0].name}")

    compile_all("avr-gcc", [one for one in theirs if one.suffix == ".c"], *C, "-w")
    compile_all("avr-g++", [one for one in theirs if one.suffix == ".cpp"], *CPP, "-w")
    compile_all("avr-gcc", sorted((firmware_dir / "src").glob("*.c")), *C, "-Wall", "-Wextra", "-Werror")
    example = firmware_dir / "examples" / "Attitude" / "Attitude.ino"
    compile_all(
        "avr-g++", [example], *CPP, "-Wall", "-Wextra", "-Werror", "-include", "Arduino.h", "-x", "c++"
    )
    objects = [str(one) for one in sorted(folder.glob("*.o"))]
    run_tool(["avr-gcc", BOARD[0], "-Wl,--gc-sections", *objects, "-lm", "-o", "sketch.elf"], cwd=folder)
    return folder / "sketch.elf"


def test_builder_finds_every_source_of_the_core(firmware_dir):
    core = {one.name for one in (firmware_dir / "core").glob("*.c")}
    brought = {one.name: one.read_text().split("\n")[-2] for one in (firmware_dir / "src").glob("*.c")}
    assert brought == {name: f'#include "../core/{name}"' for name in core}, (
        "firmware/src has one file for each of firmware/core, which includes it"
    )


def test_library_says_what_the_builder_asks(firmware_dir):
    lines = (firmware_dir / "library.properties").read_text(encoding="utf-8").splitlines()
    said = dict(line.split("=", 1) for line in lines)
    for name in ("name", "version", "author", "sentence", "paragraph", "category", "url", "architectures"):
        assert said[name], name
    assert re.fullmatch(r"\d+\.\d+\.\d+", said["version"])
    assert (firmware_dir / "src" / said["includes"]).is_file()


@pytest.mark.parametrize("compiler", ["g++", "avr-g++"])
def test_every_header_of_the_core_is_cpp_too(firmware_dir, avr_toolchain, c_compiler, tmp_path, compiler):
    headers = sorted((firmware_dir / "core").glob("*.h")) + sorted((firmware_dir / "app").glob("*.h"))
    headers = [one for one in headers if not re.fullmatch(r".*_avr|filter_.*", one.stem)]  # parts of others
    source = tmp_path / "all.cpp"
    source.write_text("".join(f'#include "{one}"\n' for one in headers))
    machine = ["-mmcu=atmega328p"] if compiler == "avr-g++" else []
    run_tool([compiler, *machine, "-std=c++11", "-Wall", "-Wextra", "-Werror", "-Wno-unused-variable",
              "-fsyntax-only", str(source)])  # fmt: skip


def test_sketch_prints_the_angles_of_the_image(sketch, avr_image, avr_simulator, rng, tmp_path):
    turning = np.cumsum(rng.normal(0.0, 60.0, (300, 7)), axis=0)
    turning += [500, -300, 4000, -3000, 40, 20, -30]
    counts = turning.astype("<i2")
    (tmp_path / "samples").write_bytes(counts.tobytes())
    files = [sketch, tmp_path / "samples", tmp_path / "records"]
    facts = json.loads(run_tool([str(avr_simulator), *map(str, files)]))
    assert facts["rows"] == len(counts)
    records = np.fromfile(tmp_path / "records", RECORD)
    lines = decode(records["value"][records["kind"] == b"B"].tobytes())
    assert [line.sequence for line in lines] == list(range(len(lines)))
    assert len(lines) >= len(counts) - 1  # the emulation ends while the last line is on its way

    image = emulate_avr(avr_image(FILTER="mahony_q"), counts, mode="t", simulator=avr_simulator)
    np.testing.assert_array_equal([line.roll_pitch_yaw for line in lines], image.roll_pitch_yaw[: len(lines)])
