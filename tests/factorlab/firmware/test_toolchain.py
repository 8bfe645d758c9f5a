"""A missing compiler or emulator is one sentence with the Debian package."""

import sys

import pytest

from factorlab.firmware import toolchain
from sequential.errors import ToolMissingError


@pytest.mark.parametrize(
    ("target", "package"), [("m4", "gcc-arm-none-eabi"), ("avr", "gcc-avr"), ("avr", "avr-libc")]
)
def test_what_lacks_is_named(target, package, monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(ToolMissingError, match=rf"apt install .*{package}"):
        toolchain.require_tools(target)


@pytest.mark.parametrize(("target", "package"), [("m4", "qemu-system-arm"), ("avr", "libsimavr-dev")])
def test_emulating_asks_for_more(target, package, monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    assert package not in toolchain.missing_tools(target)
    assert package in toolchain.missing_tools(target, emulate=True)


def test_the_error_of_a_tool_is_quoted():
    with pytest.raises(ToolMissingError, match="failed: error: no such board"):
        toolchain.run_tool([sys.executable, "-c", "raise SystemExit('error: no such board')"])


def test_a_tool_that_is_not_there_is_named():
    with pytest.raises(ToolMissingError, match="apt install gcc-avr"):
        toolchain.run_tool(["avr-gcc"], path="/nowhere")
