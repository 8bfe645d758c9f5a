"""`factorlab characterize`: what it prints, writes and refuses, on simulated and real recordings."""

import json
import re
import subprocess

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from sequential import ImuNoise
from sequential.readers import read_kalibr_imu, write_imu
from sequential.sensors import ImuErrors, ImuRecording, simulate_imu, tumble

NOISE = ImuNoise(gyro_density=2e-4, accel_density=2e-3, gyro_bias_walk=1e-6, accel_bias_walk=1e-6)
RATE, REST = 50.0, 60.0
GYRO_SIGMA = 2e-4 * RATE**0.5
BIAS = np.array([0.02, -0.01, 0.005])


def run(*arguments):
    return CliRunner().invoke(main, ["characterize", *map(str, arguments)])


def whole(*arguments):
    done = run(*arguments, "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def recording():
    rng = np.random.default_rng(5)
    errors = ImuErrors(NOISE, gyro_bias=BIAS, gyro_lsb=1e-4, accel_lsb=1e-3)
    motion = tumble(REST + 15.0, rng, rest=REST)
    return simulate_imu(motion, rng, rate=RATE, errors=errors, field=None, name="imu").recording


@pytest.fixture
def log(recording, tmp_path):
    write_imu(recording, tmp_path / "imu.csv")
    return tmp_path / "imu.csv"


def test_the_still_part_is_found_and_its_numbers_are_true(log):
    found = whole(log)
    start, stop = found["window"]
    assert start < 1.0
    assert REST - 3.0 < stop < REST + 0.5
    for name, bias in zip(("gx", "gy", "gz"), BIAS, strict=True):
        axis = found["axes"][name]
        assert axis["sigma"]["value"] == pytest.approx(GYRO_SIGMA, rel=0.06)
        assert axis["bias"]["value"] == pytest.approx(bias, abs=2e-4)
        assert axis["lsb"] == pytest.approx(1e-4, rel=1e-3)
        assert axis["allan"]["N"]["low"] < 2e-4 < axis["allan"]["N"]["high"]
    assert found["imu_noise"]["gyro_density"] == pytest.approx(2e-4, rel=0.05)
    assert "gyro_bias_walk" in found["upper_bounds"], "a minute shows no bias walk of this size"


def test_what_is_too_short_to_see_is_said(log):
    told = {one["metric"]: one for one in whole(log)["verdicts"]}
    plateau = next(one for metric, one in told.items() if metric.startswith("Allan B of g"))
    assert plateau["value"] is None
    assert plateau["verdict"] == "INFO"
    assert re.search(
        r"no plateau can be read from 5\d.* s: .* at most .*record for about", plateau["meaning"]
    )


def test_an_r_eight_times_too_small_is_called_so(log):
    sigma = GYRO_SIGMA / 8**0.5
    told = whole(log, "--sigma", f"gyro={sigma}")["verdicts"]
    judged = [one for one in told if one["metric"].startswith("declared R of g")]
    assert len(judged) == 3
    for one in judged:
        assert one["verdict"] == "FAIL"
        low, high = one["band"]
        assert low < one["value"] < high
        assert one["value"] == pytest.approx(8.0, rel=0.15)
        times = re.match(r"your R is ([\d.]+)x too small", one["meaning"])
        assert float(times.group(1)) == pytest.approx(8.0, rel=0.15)
    last = " ".join(run(log, "--sigma", f"gyro={sigma}").stdout.split())
    assert re.search(r"In short: accelerometer σ .*bias up to 1\.1\d °/s; Allan N", last)
    assert re.search(r"your R of g. is [78]\.?\d*x too small\.$", last)
    same = whole(log, "--r", f"gx={sigma**2}")["verdicts"]
    assert sum(one["metric"].startswith("declared R") for one in same) == 1


@pytest.mark.parametrize(
    ("times", "status", "words"), [(1.0, "PASS", "your R fits"), (9.0, "WARN", "too large")]
)
def test_an_r_that_fits_and_one_too_large(log, times, status, words):
    told = whole(log, "--r", f"gy={times * GYRO_SIGMA**2}")["verdicts"]
    one = next(one for one in told if one["metric"] == "declared R of gy")
    assert one["verdict"] == status
    assert words in one["meaning"]


def test_check_ends_with_3_where_something_fails(log):
    assert run(log, "--r", f"gx={GYRO_SIGMA**2 / 8}", "--check").exit_code == 3
    assert run(log, "--r", f"gx={GYRO_SIGMA**2}", "--check").exit_code == 0


def test_declared_densities_are_compared(log, tmp_path):
    (tmp_path / "imu.yaml").write_text(
        "gyroscope_noise_density: 2.0e-5\naccelerometer_noise_density: 2.0e-3\n"
        "gyroscope_random_walk: 1.0e-6\naccelerometer_random_walk: 1.0e-2\nupdate_rate: 50.0\n",
        encoding="utf-8",
    )
    told = {one["metric"]: one for one in whole(log, "--noise", tmp_path / "imu.yaml")["verdicts"]}
    assert told["declared noise density, gyro"]["verdict"] == "FAIL"
    assert re.search(r"(9\.\d|10)x too small", told["declared noise density, gyro"]["meaning"])
    assert told["declared noise density, accelerometer"]["verdict"] == "PASS"
    assert "too short" in told["declared bias walk, gyro"]["meaning"]
    assert "safe side" in told["declared bias walk, accelerometer"]["meaning"]


def test_the_folder_holds_page_numbers_and_kalibr_s_file(log, tmp_path):
    done = run(log, "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 5
    found = json.loads((tmp_path / "out/report.json").read_text(encoding="utf-8"))
    assert sorted(found["files"]) == ["imu.yaml", "report.html", "report.json"]
    kalibr = read_kalibr_imu(tmp_path / "out/imu.yaml")
    assert kalibr.noise.gyro_density == pytest.approx(found["imu_noise"]["gyro_density"])
    assert kalibr.rate == pytest.approx(RATE, rel=1e-3)
    again = run(log, "-o", tmp_path / "out")
    assert again.exit_code == 1
    assert "--force" in again.stderr


def test_a_chosen_part(log):
    found = whole(log, "--still", "10:30")
    assert found["window"] == [10.0, 30.0]
    assert found["axes"]["gx"]["n"] == pytest.approx(1001, abs=1)


def test_a_stuck_axis_fails(recording, tmp_path):
    gyro = np.array(recording.gyro)
    gyro[:, 1] = 0.0
    write_imu(ImuRecording(recording.t, recording.accel, gyro), tmp_path / "stuck.csv")
    done = run(tmp_path / "stuck.csv")
    assert done.exit_code == 1, "a failure of health is an error of the data"
    assert "stuck" in done.stdout
    assert re.search(r"^FAIL .*σ of gy", done.stdout, re.MULTILINE)


@pytest.mark.parametrize(
    ("arguments", "code", "pattern"),
    [
        (["{folder}/no.csv"], 1, "no file"),
        (["{log}", "--column", "gxx"], 1, "no column 'gxx'.*did you mean"),
        (["{log}", "--still", "30:10"], 2, "START:STOP"),
        (["{log}", "--still", "100:200"], 1, "no reading between"),
        (["{log}", "--still", "1:1.2"], 1, "50 at least"),
        (["{log}", "--r", "much"], 2, r"\[NAME=\]VALUE"),
        (["{log}", "--r", "1e-6"], 1, "say which: accel=VALUE"),
        (["{log}", "--r", "gyr=1e-6"], 1, "did you mean 'gyro'"),
        (["{log}", "--r", "gyro=-1"], 1, "must be positive"),
        (["{log}", "--r", "gx=1", "--sigma", "gx=1"], 1, "both R and σ"),
        (["{log}", "--lang", "de"], 2, "'de' is not one of"),
        (["{log}", "--noise", "{folder}/no.yaml"], 1, "no file"),
        (["{log}", "--kind", "mpu"], 1, "no kind 'mpu'"),
        (["{log}", "--bits", "0"], 2, "--bits"),
    ],
)
def test_bad_input_is_one_sentence(log, arguments, code, pattern):
    done = run(*(one.format(log=log, folder=log.parent) for one in arguments))
    assert done.exit_code == code, (done.stdout, done.stderr)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert re.search(pattern, done.stderr), done.stderr


def test_a_real_mpu6050(data_dir):
    found = whole(data_dir / "imu/mpu6050/example_data_tinit_calc.csv", "--kind", "mpu6050")
    assert found["window"] is None, "449 s, all at rest"
    for name, density in (("gx", 0.00751), ("gy", 0.01123), ("gz", 0.00934)):
        N = found["axes"][name]["allan"]["N"]["value"]
        assert np.degrees(N) == pytest.approx(density, rel=0.03)
        assert not found["axes"][name]["allan"]["B"]["visible"], "seven minutes are too short for the plateau"
    told = {one["metric"]: one for one in found["verdicts"]}
    assert told["|acceleration| at rest"]["verdict"] == "WARN"
    assert "201° in a minute" in told["bias of gx"]["meaning"]


def test_a_real_recording_that_moves(data_dir):
    found = whole(data_dir / "imu/mpu6050/example_data_calibration.csv", "--kind", "mpu6050")
    assert found["window"][0] == 0.0
    assert 35.0 < found["window"][1] < 38.0, "36.5 s still at the start, says its header"


def test_the_page_is_silent_in_a_browser(browser, log, tmp_path):
    assert run(log, "-o", tmp_path / "out", "--lang", "fr").exit_code == 0
    done = subprocess.run(
        [
            browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
            "--enable-logging=stderr", "--v=0", "--dump-dom", (tmp_path / "out/report.html").as_uri(),
        ],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert "CONSOLE" not in done.stderr
    assert done.stdout.count("<svg") == 5
    assert "Variance d'Allan" in done.stdout


def test_a_change_of_rate_leaves_no_allan_deviation(recording, tmp_path):
    still = recording.slice(0.0, REST - 2.0)
    t = np.where(still.seconds < 30.0, still.seconds, 30.0 + 2.5 * (still.seconds - 30.0))
    write_imu(ImuRecording(t, still.accel, still.gyro), tmp_path / "rate.csv")
    found = whole(tmp_path / "rate.csv")
    assert found["imu_noise"] is None
    assert "allan" not in found["axes"]["gx"]
    told = [one["meaning"] for one in found["verdicts"] if one["verdict"] == "WARN"]
    assert any("rate" in one and "changes from 50" in one for one in told)


def test_a_pause_is_said(recording, tmp_path):
    still = recording.slice(0.0, REST - 2.0)
    t = still.seconds + 4.0 * (still.seconds > 30.0)
    write_imu(ImuRecording(t, still.accel, still.gyro), tmp_path / "pause.csv")
    found = whole(tmp_path / "pause.csv")
    assert found["timing"]["gaps"][0] == pytest.approx([30.0, 4.02], abs=0.05)
    assert found["timing"]["missing"] == 200
    assert any("Gaps: 1" in one["meaning"] for one in found["verdicts"])
