"""`factorlab record serial` on the image for the ATmega328P, run in real time behind a pseudo-terminal."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.firmware.avr import emulate_avr, live_avr
from factorlab.firmware.emulation import mpu6050_counts
from sequential.readers import read_imu
from sequential.sensors import simulate_imu, tumble
from sequential.sensors.calibration_header import c_header, calibration_hash, nominal_calibration

SECONDS = 1.5


@pytest.fixture
def counts(rng):
    """A sensor turned in a hand, with the noise that tells it from one that is stuck."""
    recording = simulate_imu(tumble(10.0, rng, rest=1.0), rng, rate=100.0, field=None).recording
    return np.clip(mpu6050_counts(recording) + rng.integers(-4, 5, (1001, 7)), -32768, 32767)


@pytest.fixture
def live(avr_image, avr_simulator):
    """The ATmega328P with a filter."""

    def run(filter_, counts):
        return live_avr(avr_image(FILTER=filter_), counts, simulator=avr_simulator)

    return run


def recorded(board, path, *options):
    with board as port:
        done = CliRunner().invoke(
            main,
            ["record", "serial", port, "-o", str(path), "--seconds", str(SECONDS), "--json", *options],
        )
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert (told["lost"], told["corrupt"], told["discarded"], told["missing"]) == (0, 0, 0, 0)
    assert told["samples"] == round(SECONDS * 100)
    assert told["timing"]["period_ms"] == 10.0
    return told


def assert_samples(path, counts):
    """The recording is a stretch of the counts, sample for sample."""
    imu = read_imu(path)
    scales = [8 * 9.80665 / 32768] * 3 + [np.radians(2000) / 32768] * 3
    found = np.rint(np.hstack([imu.accel, imu.gyro]) / scales).astype(int)
    served = counts[:, [0, 1, 2, 4, 5, 6]]
    (start,) = np.flatnonzero((served == found[0]).all(axis=1))
    np.testing.assert_array_equal(found, served[start : start + len(found)])


def test_raw_samples_are_those_of_the_sensor(live, counts, tmp_path):
    path = tmp_path / "imu.csv"
    told = recorded(live("none", counts), path)
    assert (told["board"]["target"], told["board"]["filter"]) == ("atmega328p", "none")
    assert_samples(path, counts)


def test_a_recording_of_the_board_goes_through_attitude(live, counts, tmp_path):
    path = tmp_path / "imu.csv"
    recorded(live("none", counts), path)
    done = CliRunner().invoke(main, ["attitude", str(path), "--filter", "mahony", "--json"])
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize("mode", ["quaternion", "angles", "text"])
def test_attitudes_are_those_of_the_same_image_run_ahead_of_time(
    live, avr_image, avr_simulator, counts, tmp_path, mode
):
    path = tmp_path / "attitude.csv"
    image = avr_image(FILTER="mahony_q")
    told = recorded(live("mahony_q", counts), path, "--mode", mode)
    assert told["board"]["filter"] == "mahony_q"
    rows = np.array(
        [[float(cell) for cell in line.split(",")[:8]] for line in path.read_text().splitlines()[2:]]
    )
    frames = emulate_avr(image, counts, mode=mode[0], simulator=avr_simulator).frames
    expected = {frame.t_us: frame for frame in frames if frame is not None}
    # a line of text cannot say that the sensor is still starting
    known = [(row, expected[t_us]) for row in rows if (t_us := round(row[0] * 1e6)) in expected]
    assert len(known) >= len(rows) - 40
    assert mode == "text" or len(known) == len(rows)
    for row, frame in known:
        if mode == "quaternion":
            q = np.array(frame.world_q_body)
            np.testing.assert_allclose(row[1:5], q / np.linalg.norm(q), atol=1e-8)
        else:
            np.testing.assert_allclose(row[5:8], np.degrees(frame.roll_pitch_yaw), atol=1e-4)


def test_the_board_carries_the_hash_of_its_calibration(avr_image, avr_simulator, counts, tmp_path):
    """From calibration.json to the header, into the image, out of its boot frame, back to the file."""
    calibration = replace(nominal_calibration(), mag=None)
    calibration.save(tmp_path / "calibration.json")
    (tmp_path / "calibration.h").write_text(c_header(calibration), encoding="utf-8")
    image = avr_image(FILTER="mahony_q", CALIBRATION=str(tmp_path / "calibration.h"))
    with live_avr(image, counts, simulator=avr_simulator) as port:
        options = "-o", str(tmp_path / "imu.csv"), "--calibration", str(tmp_path / "calibration.json")
        done = CliRunner().invoke(main, ["record", "serial", port, "--seconds", "0.5", *options])
    assert done.exit_code == 0, done.output
    assert "warn" not in done.output
    assert f"calibration {calibration_hash(calibration):08x}" in done.stdout
