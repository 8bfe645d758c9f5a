"""Images for the boards, built once a session."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from factorlab.firmware.avr import build_simulator
from factorlab.firmware.recorded import build_host
from factorlab.firmware.toolchain import run_tool


@pytest.fixture(scope="session")
def avr_image(
    avr_toolchain: str, firmware_dir: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., Path]:
    """Build firmware.elf of ports/avr with variables of its Makefile: avr_image(FILTER="none")."""
    built: dict[tuple[tuple[str, str], ...], Path] = {}

    def build(**variables: str) -> Path:
        key = tuple(sorted(variables.items()))
        if key not in built:
            out = tmp_path_factory.mktemp("avr")
            words = [f"{name}={value}" for name, value in variables.items()]
            run_tool(["make", "-s", "-C", str(firmware_dir / "ports" / "avr"), f"OUT={out}", *words])
            built[key] = out / "firmware.elf"
        return built[key]

    return build


@pytest.fixture(scope="session")
def avr_simulator(simavr: str, c_compiler: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program that runs an image on samples."""
    return build_simulator(tmp_path_factory.mktemp("simulator"))


@pytest.fixture(scope="session")
def m4_image(
    arm_toolchain: str, firmware_dir: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., Path]:
    """Build firmware.elf of ports/cortex_m4 with variables of its Makefile: m4_image(FILTER="none")."""
    built: dict[tuple[tuple[str, str], ...], Path] = {}
    core = tmp_path_factory.mktemp("m4_core")

    def build(**variables: str) -> Path:
        key = tuple(sorted(variables.items()))
        if key not in built:
            out = tmp_path_factory.mktemp("m4")
            words = [
                f"OUT={out}",
                f"CORE_OUT={core}",
                *(f"{name}={value}" for name, value in variables.items()),
            ]
            run_tool(["make", "-s", "-j2", "-C", str(firmware_dir / "ports" / "cortex_m4"), *words])
            built[key] = out / "firmware.elf"
        return built[key]

    return build


@pytest.fixture(scope="session")
def host_program(c_compiler: str, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Build the application with a filter for this computer: host_program("mahony_q")."""

    core = tmp_path_factory.mktemp("host_core")

    @cache
    def build(name: str) -> Path:
        return build_host(tmp_path_factory.mktemp("host"), filter=name, core=core)

    return build
