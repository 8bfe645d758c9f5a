"""Mahony's filter in assembler on the ATmega328P: the bits of the C, and what it takes."""

import subprocess

import numpy as np
import pytest
from fixed_filters import FixedFilter, resampled
from mahony_port import SETTINGS, SOURCES, STATE, still

from factorlab.firmware.cycles import count_cycles
from factorlab.firmware.sizes import module_sizes

pytestmark = pytest.mark.usefixtures("avr_toolchain", "simavr")
PACKED = np.dtype(STATE)


@pytest.fixture(scope="session")
def filter_q(c_compiler, tmp_path_factory):
    return FixedFilter(c_compiler, tmp_path_factory.mktemp("mahony_q"), "mahony", STATE, SETTINGS, SOURCES)


def on_both(filter_q, samples, periods):
    """Cycles counted on the AVR, and whether each state is this machine's."""
    counts = count_cycles("mahony_q", samples, periods)
    states = counts.states.copy().view(PACKED)[:, 0]
    expected, _ = filter_q.run(samples, periods)
    return counts, np.array([all((a[n] == b[n]).all() for n in PACKED.names)
                             for a, b in zip(states, expected, strict=True)])  # fmt: skip


@pytest.mark.parametrize("name", ["broad:07", "broad:21", "xio"])
def test_a_recording_in_its_bits_cycles_and_stack(filter_q, data_dir, name):
    samples, _ = resampled(name, field=False, part=(40, 100))
    periods = np.minimum(np.arange(len(samples)), 1)
    counts, equal = on_both(filter_q, samples, periods)
    assert equal.all()
    assert counts.worst <= 4000
    assert counts.stack <= 100


def test_wild_samples_in_their_bits_and_cycles(filter_q, rng):
    """Every scale of both sensors, ends of ranges, zeros, missing samples, pauses."""
    count = 6000
    samples = still(count)
    shift = rng.integers(0, 31, (count, 1))
    samples["gyro"] = rng.integers(-(2**31), 2**31, (count, 3)) >> shift
    samples["accel"] = rng.integers(-(2**15), 2**15, (count, 3)) >> (shift % 15)
    for end in (0, -(2**15), 2**15 - 1):
        samples["accel"][rng.random((count, 3)) < 0.03] = end
    samples["accel"][rng.random(count) < 0.02] = 0
    samples["gyro"][rng.random((count, 3)) < 0.02] = -(2**31)
    periods = np.where(rng.random(count) < 0.98, 1, rng.integers(1, 40, count))
    periods[rng.random(count) < 0.002] = 255
    periods[0] = 0
    counts, equal = on_both(filter_q, samples, periods)
    assert equal.all()
    assert counts.cycles[(periods == 1)].max() <= 5000
    assert counts.stack <= 100


def test_winding_up_and_resting_in_their_bits_and_cycles(filter_q):
    """The bias at its limit on every axis, the error at its own, then rest: the long ways through."""
    count = 4000
    samples = still(count, accel=(6.0, -3.0, 8.0))
    samples["gyro"] = np.round(np.multiply([0.3, -0.25, 0.2], 2**24))
    samples["gyro"][2000:] = np.round(np.multiply([0.05, -0.05, 0.02], 2**24))
    samples["accel"][2000:] = 0, 0, 2510
    counts, equal = on_both(filter_q, samples, np.minimum(np.arange(count), 1))
    assert equal.all()
    assert counts.worst <= 5000


def test_starts_in_their_bits(filter_q, rng):
    count = 1500
    samples = still(count)
    samples["accel"] = rng.integers(-(2**15), 2**15, (count, 3)) >> rng.integers(0, 16, (count, 1))
    samples["accel"][rng.random((count, 3)) < 0.2] = 0
    states = count_cycles("mahony_q", samples, np.zeros(count)).states.copy().view(PACKED)[:, 0]
    for sample, state in zip(samples[:, None], states, strict=True):
        assert (filter_q.run(sample, [0])[0]["q"][0] == state["q"]).all()


def test_flash_and_state():
    sizes = module_sizes("mahony_q", "avr")
    assert sizes.text <= 4096
    assert sizes.state <= 64


def test_products_in_assembler_are_those_in_c(firmware_dir, tmp_path):
    image = tmp_path / "products.elf"
    sources = [firmware_dir / "check" / "products.c", firmware_dir / "core" / "fixed_q.c"]
    flags = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-std=gnu99", "-Os"]
    subprocess.run(["avr-gcc", *flags, *sources, "-o", image], check=True)
    command = ["simavr", "-m", "atmega328p", "-f", "16000000", image]
    said = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert "products 20441 0" in said.stdout + said.stderr
