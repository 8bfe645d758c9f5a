"""`factorlab info` on recordings of an IMU: what they hold, and their health."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from sequential.noise import ImuNoise
from sequential.readers import write_imu, write_log
from sequential.sensors import ImuErrors, simulate_imu, tumble


def info(*arguments):
    return CliRunner().invoke(main, ["info", *map(str, arguments)])


@pytest.fixture
def recording(rng):
    errors = ImuErrors(ImuNoise(2e-4, 2e-3, 0.0, 0.0), gyro_bias=(0.01, 0.0, 0.0), mag_sigma=0.3)
    return simulate_imu(tumble(20.0, rng, rest=3.0), rng, errors=errors).recording


def test_a_file(tmp_path, recording):
    write_imu(recording, tmp_path / "mine.csv")
    done = info(tmp_path / "mine.csv")
    assert done.exit_code == 0, done.output
    assert "mine: 20.00 s at 100 Hz" in done.output
    assert "accel in m/s^2, gyro in rad/s, mag in uT" in done.output


def test_findings_in_words_and_json(tmp_path, recording):
    path = tmp_path / "mine.csv"
    write_imu(recording, path)
    path.write_text(path.read_text().replace("rad/s", "deg/s"))
    assert "fail: gravity turns 57 times as far as the gyro does" in info(path).output
    document = json.loads(info(path, "--json").stdout)
    found = document["recordings"]["mine"]
    assert found["units"] == {"accel": "m/s^2", "gyro": "rad/s", "mag": "uT"}
    assert [f["severity"] for f in found["findings"]] == ["fail"]
    assert document["logs"]["mine"]["imu"]["readings"] == 2001
    assert "fail" not in info(path, "--units", "gyro=rad/s").output


def test_a_name_with_truth(data_dir):
    done = info("broad:07")
    assert "with the true attitude of 50924 of 52518 samples" in done.output
    assert info("brod:07").exit_code == 1
    assert "did you mean 'broad'" in info("brod:07").output


def test_a_log_of_streams_stays_a_log(tmp_path, recording):
    write_log(tmp_path / "log.csv", recording.to_log())
    assert "mag" in info(tmp_path / "log.csv").output
    assert "accel in" not in info(tmp_path / "log.csv").output
    wide = "t,imu.ax,imu.ay,imu.az,gps.x,gps.y\n0,0,0,9.8,1,2\n1,0,0,9.8,1,2\n"
    (tmp_path / "wide.csv").write_text(wide)
    assert "gps" in info(tmp_path / "wide.csv").output


def test_a_file_without_a_rate(tmp_path):
    rows = np.random.default_rng(1).normal([0.0, 0.0, 9.8], 0.1, size=(100, 3))
    np.savetxt(tmp_path / "x.csv", rows, delimiter=",", header="ax,ay,az", comments="")
    done = info(tmp_path / "x.csv")
    assert done.exit_code == 1
    assert "--rate" in done.output
    assert "at 50 Hz" in info(tmp_path / "x.csv", "--rate", "50").output
