"""`factorlab record serial`, with a board played by a thread on a pseudo-terminal."""

import errno
import hashlib
import json
import math
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import serial
from click.testing import CliRunner
from serial_board import Board, attitude, counts, encoders

from factorlab.cli import main
from factorlab.live import SerialPort
from sequential.readers import read_imu, read_tum
from sequential.sensors.calibration_header import nominal_calibration

SCALES = np.array([8 * 9.80665 / 32768] * 3 + [math.radians(2000) / 32768] * 3)
FAST = 0.0005
COMMAND = [sys.executable, "-m", "factorlab", "record", "serial"]


@pytest.fixture(scope="module")
def core(c_compiler, tmp_path_factory):
    return encoders(c_compiler, tmp_path_factory.mktemp("core"))


def record(port, path, *options):
    return CliRunner().invoke(main, ["record", "serial", str(port), "-o", str(path), *options])


def recorded(port, path, *options):
    done = record(port, path, "--json", *options)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def rows(path):
    return [line.split(",") for line in path.read_text().splitlines() if line[0].isdigit()]


def test_raw_samples_become_a_recording_in_si(core, tmp_path):
    path = tmp_path / "imu.csv"
    with Board(core, pause_s=FAST) as board:
        told = recorded(board.port, path, "--seconds", "2")
    imu = read_imu(path)
    assert told["samples"] == len(imu) == 200
    assert (imu.accel_unit, imu.gyro_unit) == ("m/s^2", "rad/s")
    k = np.rint(imu.t * 1e-7).astype(int) - 5
    assert (np.diff(k) == 1).all()
    samples = np.array([counts(number) for number in k])
    assert np.allclose(np.hstack([imu.accel, imu.gyro]), samples[:, [0, 1, 2, 4, 5, 6]] * SCALES, rtol=1e-8)
    assert np.allclose(imu.temperature, 36.53 - 1000 / 340, atol=1e-6)
    assert (told["lost"], told["corrupt"], told["missing"], told["restarts"]) == (0, 0, 0, 0)
    assert told["board"]["calibration_hash"] == 0xCAFE0123
    assert told["timing"]["rate"] == pytest.approx(100.0)


def test_the_recording_goes_through_attitude(core, tmp_path):
    path = tmp_path / "imu.csv"
    with Board(core, pause_s=FAST) as board:
        recorded(board.port, path, "--seconds", "3")
    done = CliRunner().invoke(main, ["attitude", str(path), "--filter", "mahony", "--json"])
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize("mode", ["quaternion", "angles", "text"])
@pytest.mark.parametrize("ending", ["csv", "tum"])
def test_attitudes_become_a_table_or_a_trajectory(core, tmp_path, mode, ending):
    path = tmp_path / f"attitude.{ending}"
    with Board(core, pause_s=FAST, mode="r") as board:
        told = recorded(board.port, path, "--mode", mode, "--seconds", "1")
    assert (told["samples"], told["lost"], told["repeated"]) == (100, 0, 0)
    if ending == "tum":
        track = read_tum(path)
        t, q = track.t, track.quaternion
    else:
        table = np.array([[float(cell) for cell in row] for row in rows(path)])
        t, q = np.rint(table[:, 0] * 1e9).astype(int), table[:, 1:5]
        truth = np.degrees(np.array([attitude(k)[1][2] for k in np.rint(t * 1e-7 - 5)]) * 2 * np.pi / 65536)
        assert np.abs((table[:, 7] - truth + 180) % 360 - 180).max() < 0.011
        if mode != "text":
            assert np.allclose(table[:, 8:11], [0.01, 0, -0.01], atol=2**-15)
    expected = np.array([attitude(k)[0] for k in np.rint(t * 1e-7 - 5)]) / 2**30
    assert np.abs(np.abs(np.sum(q * expected, axis=1)) - 1.0).max() < 1e-7


def test_losses_are_counted_and_leave_gaps(core, tmp_path):
    path = tmp_path / "imu.csv"
    gone, spoilt, missing = frozenset({1000, 1001, 1500}), frozenset({1200}), frozenset({1300, 1301})
    # numbers of frames wrap while it is recorded
    with Board(core, pause_s=0.0002, drop=gone, spoil=spoilt, missing=missing, first=65_536 - 1100) as board:
        told = recorded(board.port, path, "--seconds", "20")
    assert (told["lost"], told["corrupt"], told["missing"]) == (4, 1, 2)
    assert told["discarded"] == 26
    k = np.rint(read_imu(path).t * 1e-7).astype(int) - 5
    assert set(range(k[0], k[-1] + 1)) - set(k) == gone | spoilt | missing


def test_a_board_that_starts_late_or_says_nothing_of_itself_is_recorded(core, tmp_path):
    with Board(core, pause_s=FAST, starts_s=0.5, noise=b"\xa5\x03\x0f$ATT,hello\r\n" * 9) as board:
        told = recorded(board.port, tmp_path / "late.csv", "--seconds", "0.5")
    assert (told["lost"], told["discarded"]) == (0, 0)
    with Board(core, pause_s=0.005, boots=False) as board:
        done = record(board.port, tmp_path / "counts.csv", "--seconds", "1", "--wait", "0.3")
    assert done.exit_code == 0
    assert "the file holds counts" in done.stderr
    assert "ax [counts]" in (tmp_path / "counts.csv").read_text()
    assert read_imu(tmp_path / "counts.csv", units="accel=±8 g,gyro=±2000 dps").accel[0, 2] > 9


def test_a_board_that_starts_again_is_asked_again(core, tmp_path):
    path = tmp_path / "imu.csv"
    with Board(core, pause_s=0.002, restart=400) as board:
        told = recorded(board.port, path, "--seconds", "8")
    assert (told["restarts"], told["lost"]) == (1, 0)
    assert (np.diff(read_imu(path).t) > 0).all()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopping_keeps_every_whole_line(core, tmp_path, number):
    path = tmp_path / "imu.csv"
    with Board(core, pause_s=0.002) as board:
        command = [*COMMAND, board.port, "-o", str(path), "--json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            deadline = time.monotonic() + 20
            while not path.with_name("imu.csv.part").exists() and time.monotonic() < deadline:
                time.sleep(0.02)
            time.sleep(0.3)
            process.send_signal(number)
            out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    told = json.loads(out)
    assert told["lost"] == 0
    assert len(rows(path)) == told["samples"] > 50
    assert {len(row) for row in rows(path)} == {8}
    assert list(tmp_path.iterdir()) == [path]


def test_a_program_that_is_killed_leaves_whole_lines(core, tmp_path):
    path = tmp_path / "imu.csv"
    with Board(core, pause_s=0.002) as board:
        command = [*COMMAND, board.port, "-o", str(path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            deadline = time.monotonic() + 20
            part = path.with_name("imu.csv.part")
            while not (part.exists() and len(rows(part)) > 200) and time.monotonic() < deadline:
                time.sleep(0.05)
            process.kill()
    assert {len(row) for row in rows(part)} == {8}
    with Board(core) as board:
        done = record(board.port, path, "--seconds", "1")
    assert done.exit_code == 1
    assert "cut off" in done.stderr


def test_a_board_that_is_unplugged_ends_the_recording_and_keeps_it(core, tmp_path):
    path = tmp_path / "imu.csv"
    with Board(core, pause_s=FAST, lasts=500) as board:
        done = record(board.port, path)
    assert done.exit_code == 1
    assert "went away" in done.stderr
    assert len(read_imu(path)) > 300


@pytest.mark.parametrize(
    ("board", "said"),
    [
        ({"mode": "q", "hears": False}, "no raw frame though it was asked"),
        ({"starts_s": 1.0}, "sent nothing; is the firmware on the board"),
        (
            {"mode": "x", "hears": False, "boots": False},
            "and no frame among them at 500000, 250000, 115200, 1000000 bit/s",
        ),
        ({"lasts": 0, "starts_s": 0.1}, "went away"),
        ({"missing": frozenset(range(100_000))}, "its sensor gives no sample"),
    ],
)
def test_a_line_without_samples_is_one_sentence_and_no_file(core, tmp_path, board, said):
    with Board(core, pause_s=FAST, **board) as played:
        done = record(played.port, tmp_path / "imu.csv", "--wait", "0.4")
    assert done.exit_code == 1
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_port_that_cannot_be_opened_is_one_sentence(core, tmp_path):
    path = tmp_path / "imu.csv"
    (tmp_path / "no_port").write_text("")
    with Board(core) as board, SerialPort(board.port):
        busy = record(board.port, path)
    for done, said in (
        (busy, "in use by another program"),
        (record(tmp_path / "ttyUSB9", path), "there is no serial port"),
        (record(tmp_path / "no_port", path), "is no serial port"),
        (record("/dev/null", path), "is no serial port"),
        (record(tmp_path, path), "cannot be opened"),
        (record("nonsense://x", path), "cannot be opened"),
    ):
        assert done.exit_code == 1
        assert said in done.stderr
        assert done.stderr.count("\n") == 1
        assert "unexpected" not in done.stderr


def test_a_port_without_permission_says_which_group_has_it(monkeypatch, tmp_path):
    def refuse(*_, **__):
        raise serial.SerialException(errno.EACCES, "could not open port: Permission denied")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    done = record(tmp_path, tmp_path / "imu.csv")
    assert done.exit_code == 1
    assert f"sudo usermod -aG {tmp_path.group()} $USER" in done.stderr


def test_a_board_built_with_another_calibration_is_told(core, tmp_path):
    calibration = tmp_path / "calibration.json"
    nominal_calibration().save(calibration)
    with Board(core, pause_s=FAST) as board:
        options = "--seconds", "0.3", "--calibration", str(calibration)
        done = record(board.port, tmp_path / "imu.csv", *options)
    assert done.exit_code == 0
    expected = hashlib.sha256(calibration.read_bytes()).hexdigest()[:8]
    assert f"built with calibration cafe0123, {calibration} is {expected}" in done.stderr


def test_a_full_disk_is_one_sentence_and_keeps_what_fits(core, tmp_path):
    path, code = tmp_path / "imu.csv", "import resource as r; r.setrlimit(r.RLIMIT_FSIZE, (60_000, -1)); "
    code += "import signal, runpy, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
    code += "sys.argv = ['factorlab', *sys.argv[1:]]; runpy.run_module('factorlab', run_name='__main__')"
    with Board(core, pause_s=0.002) as board:
        command = [sys.executable, "-c", code, *COMMAND[3:], board.port, "-o", str(path)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "holds what came before: File too large" in done.stderr
    part = path.with_name("imu.csv.part")
    assert 5_000 < part.stat().st_size <= 60_000
    assert {len(row) for row in rows(part)} == {8}


def test_a_file_that_is_there_is_kept(core, tmp_path):
    path = tmp_path / "imu.csv"
    path.write_text("mine")
    with Board(core, pause_s=FAST) as board:
        assert "--force" in record(board.port, path, "--seconds", "1").stderr
        assert path.read_text() == "mine"
        assert record(board.port, path, "--seconds", "1", "--force").exit_code == 0
        assert "no folder" in record(board.port, tmp_path / "no" / "imu.csv").stderr
    assert len(read_imu(path)) == 100


def test_the_speed_is_found_out(core, tmp_path, monkeypatch):
    """A terminal has no speed of its own, so the board is garbled unless it is read at 115200."""
    read = SerialPort.receive

    def garbled(port):
        data = read(port)
        return data if port.tried.endswith("115200") else bytes(byte & 0x55 for byte in data)

    monkeypatch.setattr(SerialPort, "receive", garbled)
    with Board(core, pause_s=0.002) as board:
        told = recorded(board.port, tmp_path / "imu.csv", "--seconds", "1", "--wait", "1")
        assert (told["samples"], told["lost"], told["discarded"]) == (100, 0, 0)
        done = record(board.port, tmp_path / "other.csv", "--baud", "57600", "--wait", "0.3")
    assert "no frame among them at 57600 bit/s" in done.stderr


def test_without_pyserial_it_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "serial", None)
    done = record("/dev/null", tmp_path / "imu.csv")
    assert done.exit_code == 1
    assert "pip install 'factorlab[live]'" in done.stderr


def test_raw_samples_are_no_trajectory(tmp_path):
    done = record("/dev/null", tmp_path / "imu.tum")
    assert done.exit_code == 2
    assert "--mode quaternion" in done.stderr


def test_doctor_says_what_boards_take():
    done = CliRunner().invoke(main, ["doctor", "--json"])
    places = json.loads(done.stdout)["places"]
    assert places["serial ports"].startswith("pyserial 3")
    assert {"firmware avr", "firmware m4", "C filters"} <= set(places)
