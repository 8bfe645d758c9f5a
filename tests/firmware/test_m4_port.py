"""The board of a Cortex-M4F: the application in QEMU, on a sensor that we invent."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.firmware.m4 import emulate_m4, live_m4, tick_periods
from factorlab.firmware.recorded import FAULTS
from sequential.errors import DataError, ShapeError, ToolMissingError
from sequential.readers import read_imu
from sequential.readers.serial import Status

GOOD, ABSENT, HUNG, BUS = (FAULTS[name] for name in ("good", "absent", "hung", "bus"))
STUCK = 25  # MPU6050_STUCK


@pytest.fixture
def counts(rng):
    """Noise on every axis, like a sensor that is moved."""
    return rng.integers(-20_000, 20_000, (600, 7))


@pytest.fixture
def recorder(m4_image, qemu):
    """The image without a filter, which sends what the sensor says."""
    image = m4_image(FILTER="none")

    def run(counts, **options):
        return emulate_m4(image, counts, **({"mode": "r"} | options))

    return run


def received(emulation):
    return np.array([frame.counts for frame in emulation.frames])


def test_every_sample_arrives_in_a_frame_of_its_own(recorder, counts):
    emulation = recorder(counts)
    assert emulation.lost == emulation.corrupt == 0
    assert not emulation.missing.any()
    np.testing.assert_array_equal(received(emulation), counts)
    sequence = np.array([frame.sequence for frame in emulation.frames])
    assert (np.diff(sequence) == 1).all()
    stamps = np.array([frame.t_us for frame in emulation.frames])
    assert (np.diff(stamps) == 10_000).all()


def test_ten_thousand_frames_without_a_loss(recorder, rng):
    counts = rng.integers(-20_000, 20_000, (10_000, 7))
    emulation = recorder(counts)
    assert emulation.lost == emulation.corrupt == 0
    np.testing.assert_array_equal(received(emulation), counts)


def test_board_says_what_it_is(recorder, counts):
    boot = recorder(counts[:3]).boot
    assert (boot.target, boot.filter, boot.sensor) == ("mps2-an386", "none", "MPU-6050")
    assert (boot.rate, boot.gyro_range, boot.accel_range) == (100, 2000, 8)
    assert boot.calibration_hash == 0


def test_ticks_of_the_real_timer_are_even(m4_image, qemu, counts):
    periods = tick_periods(m4_image(FILTER="none", CLOCK="systick"), counts[:85], shift=1)
    assert len(periods) >= 100
    # 25 MHz / 100 Hz, with reading, serial line and interrupts going on
    np.testing.assert_array_equal(periods, 250_000)


def test_a_recording_comes_over_the_serial_line(m4_image, qemu, counts, tmp_path):
    path = tmp_path / "imu.csv"
    options = ["-o", str(path), "--seconds", "1", "--json"]
    with live_m4(m4_image(FILTER="none", CLOCK="systick"), counts) as port:
        done = CliRunner().invoke(main, ["record", "serial", port, *options])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    # the recorder asks for the boot frame and for raw frames: both ways of the line are in use
    assert told["board"]["target"] == "mps2-an386"
    assert told["corrupt"] == 0
    recording = read_imu(path)
    scales = [8 * 9.80665 / 32768] * 3 + [np.radians(2000) / 32768] * 3
    found = np.rint(np.hstack([recording.accel, recording.gyro]) / scales).astype(int)
    known = {tuple(row) for row in counts[:, [0, 1, 2, 4, 5, 6]].tolist()}
    assert len(found) > 50
    assert all(tuple(row) in known for row in found.tolist())


def test_instructions_are_counted_without_the_marks(recorder, counts):
    updates = recorder(counts).update_cycles
    # no filter: its arguments, a call and a return, the same every time
    assert np.ptp(updates) == 0
    assert 0 < updates[0] < 16


def test_period_without_an_answer_is_a_missing_sample(recorder, counts):
    absent = np.arange(len(counts)) % 7 > 4
    emulation = recorder(counts, faults=np.where(absent, ABSENT, GOOD))
    assert emulation.lost == 0
    np.testing.assert_array_equal(emulation.missing, absent)
    np.testing.assert_array_equal(received(emulation)[~absent], counts[~absent])
    assert np.isnan(emulation.update_cycles[absent]).all()
    assert np.isnan(emulation.sample_s[absent]).all()


@pytest.mark.parametrize(("kind", "lasts"), [(ABSENT, 100), (HUNG, 1), (BUS, 1), (HUNG, 100), (BUS, 100)])
def test_sensor_comes_back_after_a_fault(recorder, counts, kind, lasts):
    faults = np.full(len(counts), GOOD)
    faults[100 : 100 + lasts] = kind
    emulation = recorder(counts, faults=faults)
    assert emulation.lost == 0
    assert not emulation.missing[:100].any()
    assert emulation.missing[100 : 100 + lasts].all()
    back = 100 + lasts + int(np.flatnonzero(~emulation.missing[100 + lasts :])[0])
    assert back < 100 + lasts + 40  # the start of the sensor takes 150 ms, tries are 110 ms apart
    np.testing.assert_array_equal(received(emulation)[back:], counts[back:])


def test_samples_that_never_change_are_no_samples(recorder, counts):
    counts[100:300] = counts[100]
    emulation = recorder(counts)
    assert not emulation.missing[: 100 + STUCK].any()
    assert emulation.missing[100 + STUCK : 300].all()
    assert not emulation.missing[340:].any()


def test_counts_at_the_end_of_the_range_are_marked(recorder, counts):
    counts[50, 0], counts[60, 5] = 32767, -32768
    marked = recorder(counts).has(Status.SATURATED)
    assert np.flatnonzero(marked).tolist() == [50, 60]


def test_what_is_no_sample_is_refused(recorder, counts):
    with pytest.raises(ShapeError, match=r"\(N, 7\)"):
        recorder(counts[:, :6])
    with pytest.raises(DataError, match="16 bits"):
        recorder(counts * 10)
    with pytest.raises(DataError, match="mode 'x'"):
        recorder(counts, mode="x")
    with pytest.raises(ShapeError, match="faults"):
        recorder(counts, faults=[0, 1])


def test_what_is_no_image_is_refused(tmp_path, qemu, counts):
    (tmp_path / "firmware.elf").write_bytes(b"nothing")
    with pytest.raises(ToolMissingError, match=r"emulating firmware\.elf failed"):
        emulate_m4(tmp_path / "firmware.elf", counts)


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"FILTER": "kalman"}, "no filter 'kalman'"),
        ({"BOARD": "uno"}, "no board"),
        ({"CLOCK": "x"}, "no clock"),
    ],
)
def test_makefile_says_what_it_does_not_know(m4_image, variables, said):
    with pytest.raises(ToolMissingError, match=said):
        m4_image(**variables)
