"""The board file of an STM32F4: registers, image, and what QEMU's STM32F405 makes of it."""

import shutil
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest

from factorlab.firmware.toolchain import run_tool
from sequential.errors import ToolMissingError
from sequential.readers.serial import AngleFrame, BootFrame, SerialDecoder, Status

# RM0368: base of the peripheral, offset of the register
REGISTERS = {
    "RCC->cr": 0x40023800, "RCC->pllcfgr": 0x40023804, "RCC->cfgr": 0x40023808, "RCC->ahb1enr": 0x40023830,
    "RCC->apb1enr": 0x40023840, "FLASH_ACR": 0x40023C00, "GPIOA->moder": 0x40020000,
    "GPIOA->bsrr": 0x40020018,
    "GPIOA->afr[0]": 0x40020020, "GPIOB->otyper": 0x40020404, "GPIOB->pupdr": 0x4002040C,
    "GPIOB->afr[1]": 0x40020424, "TIM2->dier": 0x4000000C, "TIM2->sr": 0x40000010, "TIM2->egr": 0x40000014,
    "TIM2->cnt": 0x40000024, "TIM2->arr": 0x4000002C, "USART2->sr": 0x40004400, "USART2->dr": 0x40004404,
    "USART2->brr": 0x40004408, "USART2->cr1": 0x4000440C, "I2C1->cr1": 0x40005400, "I2C1->cr2": 0x40005404,
    "I2C1->dr": 0x40005410, "I2C1->sr1": 0x40005414, "I2C1->sr2": 0x40005418, "I2C1->ccr": 0x4000541C,
    "I2C1->trise": 0x40005420, "SYSTICK->ctrl": 0xE000E010, "SYSTICK->load": 0xE000E014,
}  # fmt: skip
FLASH, RAM_END = 0x08000000, 0x20010000
MOST_FLASH, MOST_RAM = 16_384, 4_096  # bytes, without the stack
# place in the vector table: handler
HANDLERS = {
    1: "reset_handler", 15: "systick_handler", 16 + 28: "tim2_handler", 16 + 31: "i2c1_event_handler",
    16 + 32: "i2c1_error_handler", 16 + 38: "usart2_handler",
}  # fmt: skip
FILTERS = ("mahony_f32", "mahony_q", "none")


@pytest.fixture
def stm32f4(m4_image):
    return lambda **variables: m4_image(BOARD="stm32f4", **variables)


def symbols(image):
    lines = run_tool(["arm-none-eabi-nm", str(image)]).splitlines()
    return {name: int(address, 16) for address, _, name in (line.split() for line in lines if line[0] != " ")}


def test_registers_lie_where_the_manual_has_them(arm_toolchain, firmware_dir, tmp_path):
    board = firmware_dir / "ports" / "cortex_m4" / "stm32f4"
    table = ",".join(f"(uint32_t)&({name})" for name in REGISTERS)
    source, compiled, words = (tmp_path / name for name in ("places.c", "places.o", "places.bin"))
    source.write_text(f'#include "port.h"\nconst uint32_t places[] = {{{table}}};', encoding="utf-8")
    run_tool(
        [arm_toolchain, "-mcpu=cortex-m4", "-mthumb", f"-I{board}", "-c", str(source), "-o", str(compiled)]
    )
    run_tool(["arm-none-eabi-objcopy", "-O", "binary", "-j", ".rodata", str(compiled), str(words)])
    places = memoryview(words.read_bytes()).cast("I")
    assert dict(zip(REGISTERS, places, strict=True)) == REGISTERS


@pytest.mark.parametrize("name", FILTERS)
def test_image_fits_and_begins_as_the_core_expects(stm32f4, tmp_path, name):
    image = stm32f4(FILTER=name)
    text, data, bss = map(int, run_tool(["arm-none-eabi-size", str(image)]).splitlines()[1].split()[:3])
    assert text + data < MOST_FLASH
    assert data + bss < MOST_RAM
    binary = tmp_path / "firmware.bin"
    run_tool(["arm-none-eabi-objcopy", "-O", "binary", str(image), str(binary)])
    words = memoryview(binary.read_bytes()[: 4 * 64]).cast("I")
    known = symbols(image)
    assert known["vectors"] == FLASH
    assert words[0] == RAM_END
    assert {place: words[place] for place in HANDLERS} == {
        place: known[handler] | 1 for place, handler in HANDLERS.items()
    }


def test_no_double_arithmetic_is_linked(stm32f4):
    linked = symbols(stm32f4(FILTER="mahony_f32"))
    # soft double: __aeabi_dadd, __aeabi_d2f ...
    assert not [name for name in linked if name.startswith(("__aeabi_d", "__aeabi_f2d"))]


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"HSE": "8500000"}, "whole megahertz"),
        ({"HSE": "1000000"}, "whole megahertz"),
        ({"BAUD": "5000000"}, "BAUD is at most"),
    ],
)
def test_clock_or_line_that_cannot_be_had_is_refused(stm32f4, variables, said):
    with pytest.raises(ToolMissingError, match=said):
        stm32f4(FILTER="none", **variables)


def spoken(image, commands, enough, patience=4.0):
    """Frames of QEMU's STM32F405, in real time: it has core, SysTick and USART2, but neither RCC nor I2C."""
    board = ["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-monitor", "none"]
    line = ["-serial", "null", "-serial", "stdio", "-kernel", str(image)]
    decoder, frames = SerialDecoder(), []
    with subprocess.Popen([*board, *line], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as running:
        watch = threading.Timer(patience, running.kill)
        watch.start()
        while len(frames) < enough and (data := running.stdout.read(24)):
            frames += decoder.feed(data)
            if commands and len(frames) > 4:
                running.stdin.write(commands)
                running.stdin.flush()
                commands = b""
        watch.cancel()
        running.kill()
    assert decoder.corrupt == 0
    return frames


@pytest.mark.parametrize("phase", ["0", "1"])
def test_image_runs_without_a_sensor_and_obeys(stm32f4, qemu, phase):
    frames = spoken(stm32f4(FILTER="mahony_q", PHASE=phase), b"ab", 60)
    boot, again = (frame for frame in frames if isinstance(frame, BootFrame))
    assert (boot.target, boot.filter, boot.rate) == ("stm32f4", "mahony_q", 100)
    assert (again.target, again.filter) == (boot.target, boot.filter)
    assert len(frames) >= 60
    others = [frame for frame in frames if not isinstance(frame, BootFrame)]
    assert all(Status.SAMPLE_MISSING in frame.status for frame in others)
    assert {type(frame).__name__ for frame in others} == {"QuaternionFrame", "AngleFrame"}
    assert isinstance(others[-1], AngleFrame)
    # a busy computer may hold the emulator back for a whole period: then its number is used up
    steps = np.diff([frame.t_us for frame in others])
    assert (steps > 0).all()
    np.testing.assert_array_equal(steps % 10_000, 0)


@pytest.mark.parametrize("tool", ["st-flash", "openocd"])
def test_make_flash_writes_the_image_with_the_tool_at_hand(firmware_dir, arm_toolchain, tmp_path, tool):
    # a tool that says what it was asked to do; of the machine's own tools only those that building needs
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("make", "sh", "mkdir", "cmp", "dirname", "cat", arm_toolchain, "arm-none-eabi-objcopy"):
        (tools / Path(name).name).symlink_to(shutil.which(name))
    (tools / tool).write_text('#!/bin/sh\necho flashing "$@"\n', encoding="utf-8")
    (tools / tool).chmod(0o755)
    port, out = firmware_dir / "ports" / "cortex_m4", tmp_path / "out"
    asked = ["make", "-s", "-C", str(port), "flash", "BOARD=stm32f4", "FILTER=none", f"OUT={out}"]
    environment = {"PATH": str(tools)}
    done = subprocess.run(asked, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    wanted = f"{out}/firmware.bin 0x08000000" if tool == "st-flash" else f"program {out}/firmware.elf verify"
    assert "flashing" in done.stdout
    assert wanted in done.stdout
    (tools / tool).unlink()
    done = subprocess.run(asked, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "apt install stlink-tools" in done.stderr
