"""What a frame costs on an AVR, counted in simavr: the same number on every machine with this compiler."""

import re
import subprocess

import pytest

from factorlab.firmware.toolchain import run_tool

# cycles at worst; at 16 MHz 1 600 cycles are 0.1 ms
MOST = {"quaternion": 1100, "angles": 950, "raw": 900, "text": 4100}


@pytest.fixture(scope="module")
def cycles(avr_toolchain, simavr, firmware_dir, tmp_path_factory):
    image = tmp_path_factory.mktemp("frames") / "frames.elf"
    core = firmware_dir / "core"
    sources = [
        firmware_dir / "check" / "frame_cycles_avr.c",
        core / "frame.c",
        core / "text.c",
        core / "crc16.c",
    ]
    options = ["-mmcu=atmega328p", "-std=c99", "-O2", "-DF_CPU=16000000UL", f"-I{core}"]
    run_tool([avr_toolchain, *options, *map(str, sources), "-o", str(image)])
    command = [simavr, "-m", "atmega328p", "-f", "16000000", image]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    said = done.stdout + done.stderr  # the console of an image is on one of them, by version
    return {name: int(worst) for name, worst in re.findall(r"(quaternion|angles|raw|text) (\d+)", said)}


@pytest.mark.parametrize("name", MOST)
def test_an_encoder_keeps_its_budget(cycles, name):
    assert 0 < cycles[name] <= MOST[name]
