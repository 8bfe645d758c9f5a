"""What every test may ask for: a seeded generator, seeds for a Monte Carlo, recordings, no silent skips."""

import hashlib
import os
import shutil
from collections.abc import Callable, Generator
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import settings

FEW_SEEDS, ALL_SEEDS = 20, 200
Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)

# Kernels may compile during an example, so a deadline would measure the compiler.
settings.register_profile("few", deadline=None, derandomize=True, max_examples=50)
settings.register_profile("all", deadline=None, derandomize=True, max_examples=1000)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--full", action="store_true", help="run the whole set of seeds (also: FACTORLAB_FULL=1)"
    )


def pytest_configure(config: pytest.Config) -> None:
    settings.load_profile("all" if _is_full(config) else "few")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what asks for recordings or a browser, so that `-m "not data and not browser"` leaves it out."""
    for item in items:
        asked = getattr(item, "fixturenames", ())
        for fixture, marker in (("data_dir", "data"), ("browser", "browser")):
            if fixture in asked:
                item.add_marker(marker)


def _is_full(config: pytest.Config) -> bool:
    return config.getoption("--full") or os.environ.get("FACTORLAB_FULL", "") not in ("", "0")


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """A generator whose seed is the test's own name: the same on every run, machine and worker."""
    digest = hashlib.blake2s(request.node.nodeid.encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))


@pytest.fixture(scope="session")
def seeds(pytestconfig: pytest.Config) -> range:
    """Seeds for a Monte Carlo: a few by default, the whole set with --full."""
    return range(ALL_SEEDS if _is_full(pytestconfig) else FEW_SEEDS)


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real recordings named by FACTORLAB_DATA."""
    folder = os.environ.get("FACTORLAB_DATA")
    if not folder:
        pytest.skip("needs the real recordings: set FACTORLAB_DATA to their folder (see README, Data)")
    path = Path(folder).resolve()
    if not path.is_dir():
        pytest.skip(f"FACTORLAB_DATA names {path}, which is not a folder")
    return path


@pytest.fixture(scope="session")
def firmware_dir() -> Path:
    """The C sources of the firmware."""
    return Path(__file__).resolve().parents[1] / "firmware"


def tool(what: str, commands: tuple[str, ...], packages: str) -> Callable[[], str]:
    """A fixture that gives the path of the first of some commands, and skips where there is none."""

    @pytest.fixture(scope="session")
    def path() -> str:
        found = next((path for command in commands if (path := shutil.which(command))), None)
        if found is None:
            pytest.skip(f"needs {what}: install Debian's {packages}")
        return found

    return path


browser = tool("a browser", ("chromium", "chromium-browser", "google-chrome"), "chromium")
c_compiler = tool("a C compiler", ("gcc", "cc"), "gcc")
cxx_compiler = tool("a C++ compiler", ("g++", "c++"), "g++")
clang = tool("the compiler that brings libFuzzer", ("clang-14", "clang"), "clang and libclang-rt-dev")
cppcheck = tool("the static analysis of C", ("cppcheck",), "cppcheck")
arm_toolchain = tool("the compiler for ARM", ("arm-none-eabi-gcc",), "gcc-arm-none-eabi")
avr_toolchain = tool("the compiler for AVR", ("avr-gcc",), "gcc-avr and avr-libc")
qemu = tool("the emulator of ARM", ("qemu-system-arm",), "qemu-system-arm")
simavr = tool("the emulator of AVR", ("simavr",), "simavr")


# --- no silent skips: where FACTORLAB_NO_SKIP is set, a skip is a failure that gives the skip's reason ---


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return _forbid_skip((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _forbid_skip((yield))


def _forbid_skip(report: Report) -> Report:
    expected_failure = hasattr(report, "wasxfail")
    if os.environ.get("FACTORLAB_NO_SKIP") and report.skipped and not expected_failure:
        report.outcome = "failed"
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        report.longrepr = f"{reason}\nNothing may be skipped while FACTORLAB_NO_SKIP is set."
    return report
