"""The stack of every filter has a bound, and every image for the M4 does without double precision."""

import re

import pytest
from core_modules import filters

from factorlab.firmware.sizes import module_sizes

MOST = {"m4": 640, "avr": 640}
"""Bytes below a step: a tenth of an STM32F4's smallest bank, a third of an ATmega328P."""
MUST = {("mahony_q", "avr"): 140}


@pytest.mark.parametrize("target", MOST)
@pytest.mark.parametrize("module", filters())
def test_the_deepest_path_is_bounded(module, target, request):
    """A frame without a bound, a recursion or a call through a pointer would raise."""
    request.getfixturevalue({"m4": "arm_toolchain", "avr": "avr_toolchain"}[target])
    sizes = module_sizes(module, target)
    assert 0 < sizes.stack <= MUST.get((module, target), MOST[target])
    assert sizes.path[0] == f"{module}_step"


@pytest.mark.parametrize("module", filters())
def test_no_image_for_the_m4_computes_in_double(module, m4_image):
    image = m4_image(FILTER=module)
    linked = image.with_name("firmware.map").read_text().split("Linker script and memory map")[1]
    assert not re.findall(r"^ *0x\w+ +(__aeabi_(?:d\w+|[a-z]+2d))\b", linked, flags=re.MULTILINE)
