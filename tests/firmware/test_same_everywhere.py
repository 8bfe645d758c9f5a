"""The application on recordings: this computer, Cortex-M4 and AVR write the same bytes."""

from pathlib import Path

import numpy as np
import pytest

from factorlab.datasets.recordings import open_recording
from factorlab.firmware.avr import emulate_avr
from factorlab.firmware.emulation import mpu6050_counts
from factorlab.firmware.m4 import emulate_m4
from factorlab.firmware.recorded import FAULTS, build_host, frames_unlike, run_host
from factorlab.firmware.toolchain import run_tool
from sequential.readers.serial import Status
from sequential.sensors import AffineCalibration, ImuCalibration, c_header

RECORDINGS = ("broad:07", "broad:16", "broad:21", "broad:34", "broad:01", "broad:29")
APPLICATION = Path(__file__).resolve().parents[2] / "firmware" / "app"
FILTERS = sorted(path.stem.removeprefix("filter_") for path in APPLICATION.glob("filter_*_*.c"))
MANY, FEW = 100_000, 20_000
TARGET, CHECK = 12, slice(24, 26)  # of the boot frame, which comes first


@pytest.fixture(scope="session")
def recorded_counts(data_dir):
    """Recordings one after the other: where one begins, the filter meets a jump."""
    return np.concatenate([mpu6050_counts(open_recording(name).recording) for name in RECORDINGS])


def bad_input(rng):
    """What a sensor may say when all goes wrong, with faults of the bus between."""
    quiet = np.tile([0, 0, 4096, 0, 0, 0, 0], (200, 1)) + rng.integers(-3, 4, (200, 7))
    free_fall = np.zeros((200, 7), int) + rng.integers(-1, 2, (200, 7))
    spinning = quiet + np.array([0, 0, 0, 0, 32767, -32768, 32767])
    saturated = quiet + np.array([32767, -32768, 32767, 0, 0, 0, 0])
    stuck_gyro = np.where([1, 1, 1, 1, 0, 0, 0], quiet, [0, 0, 0, 0, 300, -300, 300])
    noise = rng.integers(-32768, 32768, (400, 7))
    zero = np.zeros((60, 7), int)
    rows = np.concatenate([quiet, free_fall, spinning, saturated, stuck_gyro, noise, zero, quiet, -quiet])
    faults = np.where(rng.random(len(rows)) < 0.2, rng.integers(1, 4, len(rows)), 0)
    faults[:20] = faults[-20:] = 0  # a bus that hangs in the last period is not told any more
    faults[500:650] = FAULTS["absent"]
    return np.clip(rows, -32768, 32767), faults


def assert_same_bytes(board, host):
    """All but the name of the target in the boot frame, and its check."""
    ours, theirs = np.frombuffer(board, np.uint8).copy(), np.frombuffer(host, np.uint8).copy()
    for data in (ours, theirs):
        data[TARGET] = 0
        data[CHECK] = 0
    np.testing.assert_array_equal(ours, theirs)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in FILTERS if name.endswith("_q")])
def test_m4_writes_what_the_host_writes(m4_image, qemu, host_program, recorded_counts, name, pytestconfig):
    few = FEW if name == "mahony_q" else FEW // 4
    counts = recorded_counts[: MANY if pytestconfig.getoption("--full") else few]
    emulation = emulate_m4(m4_image(FILTER=name), counts)
    assert emulation.lost == emulation.corrupt == 0
    assert not emulation.missing.any()
    assert_same_bytes(emulation.data, run_host(host_program(name), counts))


@pytest.mark.parametrize("name", [name for name in FILTERS if name.endswith("_f32")])
def test_floats_are_the_same_bits(m4_image, qemu, host_program, recorded_counts, name):
    counts = recorded_counts[:6000]
    emulation = emulate_m4(m4_image(FILTER=name), counts)
    assert emulation.lost == emulation.corrupt == 0
    assert_same_bytes(emulation.data, run_host(host_program(name), counts))


@pytest.mark.parametrize("mode", ["a", "t", "r"])
def test_every_mode_is_the_same(m4_image, qemu, host_program, recorded_counts, mode):
    counts = recorded_counts[:3000]
    emulation = emulate_m4(m4_image(FILTER="mahony_q"), counts, mode=mode)
    assert_same_bytes(emulation.data, run_host(host_program("mahony_q"), counts, mode=mode))


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("mode", ["q", "a"])
def test_bad_input_is_met_in_the_same_way(m4_image, qemu, host_program, rng, name, mode):
    counts, faults = bad_input(rng)
    emulation = emulate_m4(m4_image(FILTER=name), counts, mode=mode, faults=faults)
    assert emulation.lost == emulation.corrupt == 0
    host = run_host(host_program(name), counts, mode=mode, faults=faults)
    assert_same_bytes(emulation.data, host)
    assert emulation.missing[500:650].all()
    assert emulation.has(Status.SATURATED).any()
    if mode == "q":
        np.testing.assert_allclose(np.linalg.norm(emulation.world_q_body, axis=1), 1.0, atol=0.03)


def test_three_machines_send_the_same_frames(
    m4_image, qemu, host_program, avr_image, avr_simulator, recorded_counts
):
    counts = recorded_counts[:2000]
    avr = emulate_avr(avr_image(FILTER="mahony_q"), counts, simulator=avr_simulator)
    m4 = emulate_m4(m4_image(FILTER="mahony_q"), counts)
    host = run_host(host_program("mahony_q"), counts)
    assert avr.lost == m4.lost == 0
    assert frames_unlike(avr, host) == frames_unlike(m4, host) == 0
    np.testing.assert_array_equal(avr.world_q_body, m4.world_q_body)


def test_frames_of_other_samples_are_unlike(m4_image, qemu, host_program, recorded_counts):
    counts = recorded_counts[:500]
    m4 = emulate_m4(m4_image(FILTER="none"), counts, mode="r")
    changed = counts.copy()
    changed[[7, 300], 4] += 1
    assert frames_unlike(m4, run_host(host_program("none"), changed, mode="r")) == 2


@pytest.mark.parametrize("name", FILTERS)
def test_no_double_arithmetic_is_linked(m4_image, name):
    linked = run_tool(["arm-none-eabi-nm", str(m4_image(FILTER=name))])
    assert "filter_update" in linked
    assert "__aeabi_d" not in linked
    assert "__aeabi_f2d" not in linked


def test_constants_of_a_calibration_are_built_in(m4_image, qemu, tmp_path, recorded_counts, rng):
    def imperfect(kind, scale, unit):
        matrix = scale * (np.eye(3) + rng.normal(0, 0.02, (3, 3)))
        offset = rng.normal(0, 50, 3)
        return AffineCalibration(matrix, offset, kind=kind, unit_in="counts", unit_out=unit)

    gyro, accel = imperfect("gyro", 1.0653e-3, "rad/s"), imperfect("accel", 2.3942e-3, "m/s^2")
    header = tmp_path / "constants.h"
    header.write_text(c_header(ImuCalibration(gyro=gyro, accel=accel)), encoding="utf-8")
    counts = recorded_counts[:1500]
    emulation = emulate_m4(m4_image(FILTER="mahony_q", CALIBRATION=str(header)), counts)
    host = build_host(tmp_path / "host", filter="mahony_q", calibration=header)
    assert_same_bytes(emulation.data, run_host(host, counts))
    assert emulation.boot.calibration_hash != 0
    without = emulate_m4(m4_image(FILTER="mahony_q"), counts)
    assert np.abs(emulation.world_q_body - without.world_q_body).max() > 0.01
