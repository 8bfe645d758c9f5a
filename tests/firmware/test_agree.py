"""Fixed point gives the same bits on this computer, on a Cortex-M4 and on an AVR, sample for sample."""

import re
import subprocess

import pytest

MODULES = {
    "trig_q": 1, "calibration_q": 2, "mahony_q": 4, "tilt_q": 8, "complementary_q": 16, "mahony_q9": 32,
}  # fmt: skip
SAMPLES, MANY = 20_000, 100_000
FLAGS = (
    "-std=c99", "-O2", "-ffp-contract=off", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections",
    "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror",
)  # fmt: skip
M4 = (
    "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-nostartfiles",
    "--specs=nano.specs", "--specs=nosys.specs",
)  # fmt: skip
AVR = ("-mmcu=atmega328p", "-DF_CPU=16000000UL")
COLOURS = re.compile(r"\x1b\[[0-9;]*m")


def build(command, firmware_dir, image, module, samples, extra=()):
    """check/agree.c with the whole fixed-point core, for one module."""
    core = sorted((firmware_dir / "core").glob("*_q*.c"))
    defined = (f"-DAGREE_SAMPLES={samples}UL", f"-DAGREE_MODULES={MODULES[module]}")
    agree = firmware_dir / "check" / "agree.c"
    subprocess.run([*command, *FLAGS, *defined, agree, *core, *extra, "-lm", "-o", image], check=True)
    return image


@pytest.fixture(scope="session")
def samples(pytestconfig):
    return MANY if pytestconfig.getoption("--full") else SAMPLES


@pytest.fixture(scope="session")
def text_of_host(c_compiler, firmware_dir, samples, tmp_path_factory):
    """What this computer prints for a module, with overflow as an error."""
    found = {}

    def text(module):
        if module not in found:
            image = tmp_path_factory.mktemp("agree") / "agree"
            checked = (c_compiler, "-fsanitize=undefined", "-fno-sanitize-recover=all")
            build(checked, firmware_dir, image, module, samples)
            found[module] = subprocess.run([image], capture_output=True, text=True, check=True).stdout
        return found[module]

    return text


@pytest.mark.parametrize("module", MODULES)
def test_host_prints_a_line_a_block(text_of_host, samples, module):
    lines = text_of_host(module).splitlines()
    assert len(lines) == samples // 1000 + 1
    assert [line.split()[0] for line in lines] == [module] * (samples // 1000) + ["end"]
    assert len({line.split()[2] for line in lines[:-1]}) == samples // 1000, "checksums move"


@pytest.mark.parametrize("module", MODULES)
def test_m4_prints_what_the_host_prints(
    arm_toolchain, qemu, firmware_dir, text_of_host, samples, tmp_path, module
):
    port = firmware_dir / "ports" / "cortex_m4"
    extra = (
        port / "startup.c",
        port / "qemu" / "semihosting.c",
        f"-L{port}",
        "-T",
        port / "qemu" / "mps2.ld",
    )
    image = build((arm_toolchain, *M4), firmware_dir, tmp_path / "agree.elf", module, samples, extra)
    printed = tmp_path / "printed"
    subprocess.run(
        [
            qemu, "-M", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "none",
            "-semihosting-config", f"enable=on,target=native,arg=agree,arg={printed}", "-kernel", image,
        ],
        check=True,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert printed.read_text() == text_of_host(module)


@pytest.mark.slow
@pytest.mark.parametrize("module", MODULES)
def test_avr_prints_what_the_host_prints(
    avr_toolchain, simavr, firmware_dir, text_of_host, samples, tmp_path, module
):
    image = build((avr_toolchain, *AVR), firmware_dir, tmp_path / "agree.elf", module, samples)
    done = subprocess.run(
        [simavr, "-m", "atmega328p", "-f", "16000000", image], capture_output=True, text=True, check=True
    )
    # simavr colours what the UART says, and adds a full stop for the end of the line
    said = [COLOURS.sub("", line).removesuffix(".") for line in (done.stdout + done.stderr).splitlines()]
    printed = [line for line in said if line.startswith(f"{module} ") or line == "end"]
    assert printed == text_of_host(module).splitlines()
