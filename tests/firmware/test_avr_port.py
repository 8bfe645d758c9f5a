"""The board of an ATmega328P: bus, driver, clock and serial line, on a sensor that we invent."""

from pathlib import Path

import numpy as np
import pytest

from factorlab.firmware.avr import ABSENT, CLOCK_HZ, GOOD, HUNG, RECORD, emulate_avr
from factorlab.firmware.toolchain import run_tool
from sequential.errors import DataError, ShapeError, ToolMissingError
from sequential.readers.serial import BootFrame, RawFrame, SerialDecoder, Status

MISSING, OVERRUN, SATURATED = Status.SAMPLE_MISSING, Status.OVERRUN, Status.SATURATED
APP = Path(__file__).resolve().parents[2] / "firmware" / "app"
FILTERS = sorted({one.stem.removeprefix("filter_") for one in APP.glob("filter_*.c")} - {"error_state_f32"})
STUCK = 25  # MPU6050_STUCK


@pytest.fixture
def counts(rng):
    """Noise on every axis, like a sensor that is moved."""
    return rng.integers(-20_000, 20_000, (600, 7))


@pytest.fixture
def recorder(avr_image, avr_simulator):
    """The image without a filter, which sends what the sensor says."""
    image = avr_image(FILTER="none")

    def run(counts, **options):
        return emulate_avr(image, counts, **({"mode": "r"} | options), simulator=avr_simulator)

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


def test_board_says_what_it_is(recorder, counts):
    boot = recorder(counts[:3]).boot
    assert (boot.target, boot.filter, boot.sensor) == ("atmega328p", "none", "MPU-6050")
    assert (boot.rate, boot.gyro_range, boot.accel_range) == (100, 2000, 8)
    assert boot.calibration_hash == 0


@pytest.mark.parametrize("mode", ["q", "a", "r", "t"])
def test_frames_leave_at_the_phase_whatever_is_sent(recorder, counts, mode):
    emulation = recorder(counts, mode=mode)
    assert emulation.lost == 0
    assert np.abs(emulation.jitter[2:]).max() <= 2e-6
    assert (emulation.latency[2:] > 0).all()


def test_processor_sleeps_when_it_has_nothing_to_do(recorder, counts):
    emulation = recorder(counts)
    assert emulation.asleep > 0.95
    # bursts of 17 bytes, frames of 26: interrupts and arithmetic together are far from 5 % of a period
    assert emulation.stack < 200


def test_bus_runs_at_400_kilohertz(recorder, counts):
    emulation = recorder(counts)
    latency = emulation.latency[2:]
    assert np.ptp(latency) < 2e-6
    # the phase is 700 us after the tick; 17 bytes of nine bits take 383 us, interrupts between them the rest
    burst = 700e-6 - latency.mean()
    assert 400e-6 < burst < 560e-6


def test_period_without_an_answer_is_a_missing_sample(recorder, counts, rng):
    absent = rng.random(len(counts)) < 0.2
    absent[:3] = False
    emulation = recorder(counts, faults=np.where(absent, ABSENT, GOOD))
    assert emulation.lost == 0
    longest = max(len(run) for run in "".join("x" if a else " " for a in absent).split())
    assert longest < 10  # otherwise the sensor would be started anew
    np.testing.assert_array_equal(emulation.missing, absent)
    np.testing.assert_array_equal(received(emulation)[~absent], counts[~absent])
    assert np.isnan(emulation.update_cycles[absent]).all()


def test_sensor_that_was_unplugged_is_started_anew(recorder, counts):
    faults = np.full(len(counts), GOOD)
    faults[100:200] = ABSENT
    emulation = recorder(counts, faults=faults)
    assert emulation.lost == 0
    assert not emulation.missing[:100].any()
    assert emulation.missing[100:200].all()
    back = int(np.flatnonzero(~emulation.missing[200:])[0])
    assert back < 40  # a try each 110 ms, 100 ms of reset, 40 ms of start
    np.testing.assert_array_equal(received(emulation)[200 + back :], counts[200 + back :])


def test_bus_that_hangs_is_freed(recorder, counts):
    faults = np.full(len(counts), GOOD)
    faults[[100, 300]] = HUNG
    emulation = recorder(counts, faults=faults)
    assert emulation.lost == 0
    for hung in (100, 300):
        assert emulation.missing[hung]
        back = int(np.flatnonzero(~emulation.missing[hung:])[0])
        assert back < 60  # nine clocks of a period for each half, then the start of the sensor
    good = ~emulation.missing
    np.testing.assert_array_equal(received(emulation)[good], counts[good])


def test_another_sensor_is_not_read(recorder, counts):
    emulation = recorder(counts[:100], who_am_i=0x71)
    assert np.isnan(emulation.sample_s).all()
    assert emulation.lost == 0
    assert emulation.missing.all()


def test_samples_that_never_change_are_no_samples(recorder, counts):
    counts[100:300] = counts[100]
    emulation = recorder(counts)
    assert emulation.lost == 0
    assert not emulation.missing[: 100 + STUCK].any()
    assert emulation.missing[100 + STUCK : 300].all()
    back = int(np.flatnonzero(~emulation.missing[300:])[0])
    assert back < 40
    assert not emulation.missing[300 + back :].any()


def test_counts_at_the_end_of_the_range_are_marked(recorder, counts):
    counts[50, 0], counts[60, 5] = 32767, -32768
    marked = recorder(counts).has(SATURATED)
    assert np.flatnonzero(marked).tolist() == [50, 60]


def test_slow_line_loses_whole_frames_and_says_so(avr_image, avr_simulator, counts):
    image = avr_image(FILTER="none", BAUD="9600")
    emulation = emulate_avr(image, counts, mode="r", simulator=avr_simulator)
    assert emulation.corrupt == 0
    # 26 bytes take 27 ms
    assert 0.55 < emulation.lost / len(counts) < 0.75
    came = [k for k, frame in enumerate(emulation.frames) if frame is not None]
    sequence = np.array([emulation.frames[k].sequence for k in came])
    np.testing.assert_array_equal(np.diff(sequence), np.diff(came))
    after_loss = np.flatnonzero(np.diff(came) > 1) + 1
    assert all(OVERRUN in emulation.frames[came[k]].status for k in after_loss)
    np.testing.assert_array_equal([emulation.frames[k].counts for k in came], counts[came])


def test_baud_that_the_clock_cannot_give_is_refused(avr_image):
    with pytest.raises(ToolMissingError, match="cannot be had"):
        avr_image(FILTER="none", BAUD="300000")


def test_what_is_no_sample_is_refused(recorder, counts):
    with pytest.raises(ShapeError, match=r"\(N, 7\)"):
        recorder(counts[:, :6])
    with pytest.raises(DataError, match="16 bits"):
        recorder(counts * 10)
    with pytest.raises(DataError, match="mode 'x'"):
        recorder(counts, mode="x")
    with pytest.raises(ShapeError, match="faults"):
        recorder(counts, faults=[0, 1])


@pytest.mark.parametrize(
    "name",
    [one.stem.removeprefix("filter_") for one in APP.glob("filter_*.c") if "error_state" not in one.stem],
)
def test_every_filter_fits_and_runs(avr_image, avr_simulator, rng, name):
    level = np.array([0, 0, 4096, 0, 0, 0, 0]) + rng.integers(-20, 20, (200, 7))
    image = avr_image(FILTER=name)
    emulation = emulate_avr(image, level, simulator=avr_simulator)
    assert emulation.filter == name
    assert emulation.lost == emulation.corrupt == 0
    np.testing.assert_allclose(np.linalg.norm(emulation.world_q_body, axis=1), 1.0, atol=1e-3)
    # level but for the noise
    assert np.abs(emulation.world_q_body[:, 1:3]).max() < 0.02
    words = run_tool(["avr-size", str(image)]).split("\n")[1].split()
    text, data, bss = (int(word) for word in words[:3])
    assert text + data < 30_000  # 32 kB less a boot loader
    assert data + bss + emulation.stack < 1024  # of 2 kB


def test_filter_that_is_none_is_named(avr_image):
    with pytest.raises(ToolMissingError, match=r"no filter 'mahoni_q': FILTER is one of .*mahony_q"):
        avr_image(FILTER="mahoni_q")


def test_flash_writes_the_image_with_avrdude(avr_toolchain, firmware_dir, tmp_path):
    words = ["make", "-n", "-C", str(firmware_dir / "ports" / "avr"), "flash", f"OUT={tmp_path}"]
    said = run_tool([*words, "PORT=/dev/ttyUSB7"])
    command = next(line for line in said.splitlines() if line.startswith("avrdude"))
    assert "-p atmega328p" in command
    assert "-P /dev/ttyUSB7" in command
    assert f"flash:w:{tmp_path}/firmware.hex:i" in command


def test_simulator_is_clean(c_compiler, simavr, firmware_dir, tmp_path):
    for source in sorted((firmware_dir / "ports" / "avr" / "simulator").glob("*.c")):
        flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"]
        run_tool([c_compiler, *flags, "-c", str(source), "-o", str(tmp_path / "object.o")])


def test_bus_is_freed_by_nine_clocks_and_a_stop(avr_image, avr_simulator, counts, tmp_path):
    """Philips UM10204, 3.1.16: whatever byte the sensor was in, it lets go of the data line by then."""
    faults = np.zeros(len(counts), np.uint8)
    faults[100] = HUNG
    (tmp_path / "samples").write_bytes(counts.astype("<i2").tobytes())
    (tmp_path / "faults").write_bytes(faults.tobytes())
    files = [avr_image(FILTER="none"), tmp_path / "samples", tmp_path / "records"]
    run_tool([str(avr_simulator), *map(str, files), "--faults", str(tmp_path / "faults")])
    records = np.fromfile(tmp_path / "records", RECORD)
    pulled = records["value"][records["kind"] == b"D"]
    clock, data = 0x20, 0x10
    clocks = [clock, 0] * 9
    stop = [clock, clock | data, data, 0]
    assert pulled.tolist() == clocks + stop


def test_commands_are_obeyed_in_order(recorder, counts, avr_image, avr_simulator, tmp_path):
    (tmp_path / "samples").write_bytes(counts[:50].astype("<i2").tobytes())
    files = [avr_image(FILTER="none"), tmp_path / "samples", tmp_path / "records"]
    run_tool([str(avr_simulator), *map(str, files), "--send", "t?\x01bqbr"])
    records = np.fromfile(tmp_path / "records", RECORD)
    decoder = SerialDecoder()
    frames = decoder.feed(records["value"][records["kind"] == b"B"].tobytes())
    assert decoder.corrupt == decoder.discarded == 0
    assert sum(isinstance(frame, BootFrame) for frame in frames) == 3  # its own, and two that were asked for
    assert isinstance(frames[-1], RawFrame)
    assert [frame.sequence for frame in frames] == list(range(len(frames)))


def test_frame_that_misses_its_phase_leaves_when_it_is_ready(avr_image, avr_simulator, rng):
    level = np.array([0, 0, 4096, 0, 0, 0, 0]) + rng.integers(-20, 20, (200, 7))
    image = avr_image(FILTER="mahony_q", PHASE_UPDATE_US="100")
    emulation = emulate_avr(image, level, simulator=avr_simulator)
    assert emulation.lost == emulation.corrupt == 0
    # the first sample is levelled before what counts as its update
    after_update = (emulation.latency - emulation.update_cycles / CLOCK_HZ)[1:]
    assert after_update.min() > 0
    assert np.ptp(after_update) < 2e-6  # decoding before it, one byte into the ring after it


@pytest.mark.slow
def test_no_frame_of_many_is_lost(recorder, rng, pytestconfig):
    """With --full more frames than there are sequence numbers."""
    many = rng.integers(-20_000, 20_000, (66_000 if pytestconfig.getoption("--full") else 6000, 7))
    emulation = recorder(many)
    assert emulation.lost == emulation.corrupt == 0
    sequence = np.array([frame.sequence for frame in emulation.frames])
    np.testing.assert_array_equal(sequence, (sequence[0] + np.arange(len(many))) % 65536)
    np.testing.assert_array_equal(received(emulation), many)
