"""What `factorlab firmware` prints, writes and returns."""

import json

import numpy as np
import pytest
from attitude_worlds import seen, swinging
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.datasets.recordings import open_recording
from factorlab.firmware import targets
from factorlab.firmware.emulation import mpu6050_counts
from factorlab.firmware.targets import target_parity
from sequential.attitude import attitude_from_angles
from sequential.readers import read_tum
from sequential.sensors import AffineCalibration, ImuCalibration

UNITS = ("--units", "accel=m/s^2,gyro=rad/s,t=s")


def run(*arguments):
    return CliRunner().invoke(main, ["firmware", *map(str, arguments)])


@pytest.fixture
def log(tmp_path, rng):
    """Eight seconds of a slow motion, as a CSV."""
    t, angles = swinging(8.0)
    made = seen(t, attitude_from_angles(angles), mag=False, rng=rng)
    table = np.hstack([made.seconds[:, None], made.accel, made.gyro])
    path = tmp_path / "moved.csv"
    np.savetxt(path, table, delimiter=",", header="t,ax,ay,az,gx,gy,gz", comments="", fmt="%.9g")
    return path


def test_an_image_is_built_and_measured(tmp_path, avr_toolchain):
    done = run("build", "--target", "avr", "-o", tmp_path / "image", "--json")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert (tmp_path / "image" / "firmware.elf").is_file()
    assert whole["filter"] == "mahony_q"
    assert 0 < whole["bytes"]["flash"] < 32768
    assert 0 < whole["bytes"]["ram"] < 2048


def test_constants_change_the_image(tmp_path, avr_toolchain):
    bent = AffineCalibration(1.02e-3 * np.eye(3), np.array([3.0, -2.0, 1.0]), None, "gyro", "counts", "rad/s")
    saved = ImuCalibration(gyro=bent).save(tmp_path / "calibration.json")
    for name, options in (("plain", ()), ("bent", ("--constants", saved))):
        done = run("build", "--target", "avr", "-o", tmp_path / name, *options)
        assert done.exit_code == 0, done.stderr
    images = [(tmp_path / name / "firmware.elf").read_bytes() for name in ("plain", "bent")]
    assert images[0] != images[1]
    assert f"CALIBRATION={tmp_path / 'bent' / 'calibration.h'} flash" in done.stdout, (
        "how to write it to a board"
    )
    assert (tmp_path / "bent" / "calibration.h").is_file()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ("--target", "avr", "--filter", "mahony_x"),
            "there is no filter 'mahony_x' for avr; there are mahony_q",
        ),
        (("--target", "avr", "--board", "stm32f4"), "there is no board 'stm32f4' for avr"),
        (("--target", "avr", "--constants", "nowhere.json"), "nowhere.json"),
    ],
)
def test_what_cannot_be_built_is_said(tmp_path, options, said):
    done = run("build", *options, "-o", tmp_path)
    assert done.exit_code == 1
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_missing_compiler_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    done = run("build", "--target", "m4", "-o", tmp_path)
    assert done.exit_code == 1
    assert "apt install" in done.stderr
    assert "gcc-arm-none-eabi" in done.stderr


@pytest.mark.parametrize("target", ["avr", "m4"])
def test_a_log_runs_on_a_board(log, target, tmp_path, avr_toolchain, arm_toolchain, simavr, qemu):
    done = run("emulate", log, *UNITS, "--target", target, "--json", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert whole["frames"] == {"lost": 0, "corrupt": 0, "unlike_host": 0}
    assert whole["samples"] == 800
    assert whole["from_python_deg"]["max"] < 0.3
    assert whole["latency_us"]["min"] > 0.0
    taken = whole["update_cycles" if target == "avr" else "update_instructions"]
    assert 0 < taken["mean"] <= taken["max"]
    assert len(whole["trajectory"]["t_s"]) == len(whole["trajectory"]["world_q_body_wxyz"]) == 200
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for word in ("Length of an update", "When frames leave", "Memory", "<svg"):
        assert word in page
    path = read_tum(tmp_path / "out" / "orientation.tum")
    assert len(path.t) == 800
    assert (tmp_path / "out" / "timing.csv").is_file()
    assert (tmp_path / "out" / "serial.bin").stat().st_size > 800 * 16


def test_a_part_in_which_nothing_moves_is_not_judged(data_dir, arm_toolchain, qemu):
    """BROAD has a truth and judges motion only, which begins after 27 s here."""
    done = run("emulate", "broad:07", "--target", "m4", "--seconds", 4, "--json")
    assert done.exit_code == 0, done.stderr
    metrics = {one["metric"] for one in json.loads(done.stdout)["verdicts"]}
    assert "from the Python filter" in metrics
    assert "error against the truth" not in metrics


@pytest.mark.parametrize("mode", ["angles", "text"])
def test_angles_say_the_same(log, mode, avr_toolchain, simavr):
    options = ("--target", "avr", "--seconds", 4, "--json")
    quaternion, other = (
        json.loads(run("emulate", log, *UNITS, *options, "--mode", kind).stdout)
        for kind in ("quaternion", mode)
    )
    for name in ("roll", "pitch", "yaw"):
        assert other["final_deg"][name] == pytest.approx(quaternion["final_deg"][name], abs=0.03)


def test_constants_are_taken_off_on_the_board(log, tmp_path, rng, avr_toolchain, simavr):
    """Readings bent by known constants, and an image that knows them."""
    table = np.genfromtxt(log, delimiter=",", skip_header=1)
    bent = AffineCalibration(np.eye(3) / 1.05, np.array([0.2, -0.1, 0.3]), None, "accel", "m/s^2", "m/s^2")
    table[:, 1:4] = bent.raw(table[:, 1:4])
    np.savetxt(log, table, delimiter=",", header="t,ax,ay,az,gx,gy,gz", comments="", fmt="%.9g")
    saved = ImuCalibration(accel=bent).save(tmp_path / "calibration.json")
    whole = json.loads(run("emulate", log, *UNITS, "--target", "avr", "--constants", saved, "--json").stdout)
    assert whole["from_python_deg"]["max"] < 0.3


def test_a_log_without_gyro_is_refused(tmp_path):
    path = tmp_path / "still.csv"
    path.write_text("t,ax,ay,az\n" + "".join(f"{0.01 * k:.2f},0,0,9.81\n" for k in range(200)))
    done = run("emulate", path, "--units", "accel=m/s^2,t=s", "--target", "avr")
    assert done.exit_code == 1
    assert "gyro" in done.stderr


def test_the_c_filters_are_verified(log, tmp_path, c_compiler):
    done = run("verify", log, *UNITS, "--no-emulation", "--json", "--check", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert {row["filter"] for row in whole["filters"]} >= {
        "c-mahony",
        "c-mahony-q",
        "c-kalman",
        "c-complementary",
    }
    assert all(row["passed"] for row in whole["filters"])
    assert whole["conclusion"] == "Every comparison clears its bar."
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "C less Python over time" in page
    assert "mahony_q" in page, "the table of memory is there"


def test_boards_that_cannot_be_emulated_are_named(log, monkeypatch, c_compiler):
    monkeypatch.setattr(targets, "missing_tools", lambda target, **_: (f"tools-of-{target}",))
    whole = json.loads(run("verify", log, *UNITS, "--json").stdout)
    assert "apt install tools-of-avr tools-of-m4" in whole["conclusion"]
    assert all(row["passed"] is None for row in whole["targets"])


def test_an_emulated_board_is_this_computer(log, arm_toolchain, qemu, c_compiler):
    counts = mpu6050_counts(open_recording(log, units=UNITS[1]).recording)[:300]
    found = target_parity("mahony_q", "m4", counts)
    assert (found.passed, found.differing, found.samples) == (True, 0, 300)


def test_verify_without_a_log_takes_its_own(c_compiler):
    whole = json.loads(run("verify", "--no-emulation", "--json").stdout)
    assert {row["recording"] for row in whole["filters"]} == {"simulated"}
