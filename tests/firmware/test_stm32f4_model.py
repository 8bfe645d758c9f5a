"""The board file of an STM32F4 on models of its peripherals: bus, clocks, phase, serial line, faults."""

from collections import defaultdict

import numpy as np
import pytest

from factorlab.firmware.recorded import FAULTS, recorded_rows, run_host
from factorlab.firmware.toolchain import run_tool
from sequential.readers.serial import RawFrame, Status, decode

CLOCK_MHZ = 84
UPDATE_US, ANGLES_US = 600, 650
STEP_US = 0.5  # of the model
MODEL = ("board.cpp", "i2c_peripheral.cpp")
APPLICATION = ("app/app.c", "app/mpu6050.c", "app/filter_none.c", "ports/recorded/sensor.c")
CORE = ("frame.c", "text.c", "crc16.c", "trig_q.c", "fixed_q.c")


@pytest.fixture(scope="session")
def on_a_model(firmware_dir, cxx_compiler, c_compiler, tmp_path_factory):
    """Compile files of the board with a model around them: on_a_model(files, model, others)."""
    board = firmware_dir / "ports" / "cortex_m4" / "stm32f4"
    models = firmware_dir.parent / "tests" / "firmware" / "stm32"

    def build(files, model, others=()):
        folder = tmp_path_factory.mktemp("stm32")
        if others:
            flags = ["-std=c99", "-O1", "-ffunction-sections", "-c"]
            run_tool([c_compiler, *flags, *(str(firmware_dir / one) for one in others)], cwd=folder)
        places = [str(board / one) for one in files] + [str(models / one) for one in model]
        included = [f"-I{board}", f"-I{models}", "-include", "registers.hpp"]
        options = ["-std=c++17", "-O1", "-Wno-overflow", *included, "-Wl,--gc-sections"]
        objects = [str(one) for one in folder.glob("*.o")]
        program = folder / "program"
        run_tool([cxx_compiler, *options, "-x", "c++", *places, "-x", "none", *objects, "-o", str(program)])
        return program

    return build


# --- the I2C driver alone: any length, any fault, interrupts that come late ---


@pytest.fixture(scope="session")
def i2c_alone(on_a_model):
    program = on_a_model(["i2c.c"], ["i2c_alone.cpp", "i2c_peripheral.cpp"])
    return lambda *transfers: run_tool([str(program), *transfers]).splitlines()


def device_bytes(first, count):
    return bytes((7 * at + 1) % 256 for at in range(first, first + count)).hex()


@pytest.mark.parametrize("late", ["", ":s"])
@pytest.mark.parametrize("length", [1, 2, 3, 4, 5, 14, 40])
def test_bytes_are_read_whatever_their_number(i2c_alone, length, late):
    lines = i2c_alone(*[f"1:{length}{late}"] * 3)
    assert lines == [f"0 1 {device_bytes(0x20, length)} "] * 3 + ["violations 0"]


@pytest.mark.parametrize("late", ["", ":s"])
@pytest.mark.parametrize("length", [1, 2, 5])
def test_bytes_are_written_whatever_their_number(i2c_alone, length, late):
    written = bytes(0x20 + 3 * k for k in range(1, length)).hex()
    assert i2c_alone(f"{length}:0{late}") == [f"0 1  {written}", "violations 0"]


@pytest.mark.parametrize(("fault", "state", "events"), [("n", 2, 1), ("w", 2, 1), ("b", 3, 1), ("h", 1, 0)])
def test_fault_of_the_bus_is_told_and_got_over(i2c_alone, fault, state, events):
    lines = i2c_alone(f"3:0:{fault}", "1:14")
    assert lines[0].startswith(f"{state} {events} ")
    # nine clocks, a stop, and the pins given back; only where the bus hangs or failed
    assert ("freed 21" in lines) == (fault in "bh")
    assert lines[-2:] == [f"0 1 {device_bytes(0x20, 14)} ", "violations 0"]


# --- the whole board, with the application ---


@pytest.fixture(scope="session")
def board(on_a_model):
    files = ["board.c", "clock.c", "serial.c", "i2c.c"]
    return on_a_model(files, MODEL, (*APPLICATION, *(f"core/{one}" for one in CORE)))


@pytest.fixture
def run(board, tmp_path):
    """What the board says of rows: facts, bytes, and (B, 2) tick and microseconds since it, of each byte."""

    def run(rows, *broken):
        rows.tofile(tmp_path / "rows")
        paths = [str(tmp_path / name) for name in ("rows", "bytes", "times")]
        lines = run_tool([str(board), *paths, *broken]).splitlines()
        facts = {name: values for name, _, values in (line.partition(" ") for line in lines)}
        times = np.fromfile(tmp_path / "times", "<u4").reshape(-1, 2) / [1, CLOCK_MHZ]
        return facts, (tmp_path / "bytes").read_bytes(), times

    return run


@pytest.fixture
def counts(rng):
    return rng.integers(-20_000, 20_000, (400, 7))


def in_raw_mode(counts, faults=None):
    """Rows, with the command for raw frames in the second: the first tells when the sensor has started."""
    rows = recorded_rows(counts, mode="r", faults=faults)
    rows["command"][1] = ord("r")
    return rows


def first_bytes(times):
    """Microseconds from each tick to the first byte after it, by tick."""
    first = defaultdict(lambda: np.inf)
    for tick, microseconds in times:
        first[int(tick)] = min(first[int(tick)], microseconds)
    return np.array([first[tick] for tick in sorted(first) if tick > 0])


@pytest.mark.parametrize("broken", [(), ("hse",)])
def test_clocks_and_pins_are_as_documented(run, counts, broken):
    facts, _, _ = run(in_raw_mode(counts[:20]), *broken)
    assert facts == {
        "core": "84000000", "apb1": "42000000", "baud": "500000", "bus": "400000", "frequency": "42",
        "rise": "286",  # ns, 300 allowed at 400 kHz
        "pins": "7 7 4 4",  # USART2, I2C1
        "drain": "3", "debug": "42",  # both lines open; PA13 to PA15 left to the debugger
        "violations": "0",
    }  # fmt: skip


def test_board_without_a_pll_stays_at_16_megahertz(run, counts):
    facts, data, _ = run(in_raw_mode(counts[:200]), "pll")
    assert (facts["core"], facts["violations"]) == ("16000000", "0")
    assert len(decode(data)) > 10


def test_board_says_what_the_host_says(run, host_program, counts):
    absent = np.where(np.arange(len(counts)) % 7 > 4, FAULTS["absent"], 0)
    _, data, _ = run(in_raw_mode(counts, absent))
    host = run_host(host_program("none"), counts, mode="r", faults=absent)
    ours = [frame for frame in decode(data) if isinstance(frame, RawFrame)]
    theirs = [frame for frame in decode(host) if isinstance(frame, RawFrame)][-len(ours) :]
    assert len(ours) == len(counts) - 1
    assert ours == theirs


@pytest.mark.parametrize(("command", "phase"), [("r", UPDATE_US), ("q", UPDATE_US), ("a", ANGLES_US)])
def test_frames_leave_at_the_phase(run, counts, command, phase):
    rows = in_raw_mode(counts)
    rows["command"][1] = ord(command)
    _, _, times = run(rows)
    late = first_bytes(times)[30:]
    assert len(late) > 350
    assert np.ptp(late) == 0
    assert phase <= late[0] <= phase + STEP_US


def test_bytes_follow_each_other_at_the_baud(run, counts):
    _, _, times = run(in_raw_mode(counts))
    for tick in (50, 200, 350):
        gaps = np.diff(times[times[:, 0] == tick, 1])
        assert len(gaps) == 25
        np.testing.assert_allclose(gaps, 20.0, atol=STEP_US)


@pytest.mark.parametrize("kind", ["hung", "bus"])
def test_bus_that_fails_is_freed(run, counts, kind):
    faults = np.where(np.arange(len(counts)) == 100, FAULTS[kind], 0)
    facts, data, _ = run(in_raw_mode(counts, faults))
    frames = [frame for frame in decode(data) if isinstance(frame, RawFrame)]
    missing = np.array([Status.SAMPLE_MISSING in frame.status for frame in frames])
    gone = np.flatnonzero(missing)
    assert facts["violations"] == "0"
    # half a clock a period, 21 of them, then the start of the sensor
    assert 20 < len(gone) < 60
    assert np.ptp(gone) == len(gone) - 1
    sent = [frame.counts for frame, lost in zip(frames, missing, strict=True) if not lost]
    known = {tuple(row) for row in counts.tolist()}
    assert all(tuple(one) in known for one in sent)
