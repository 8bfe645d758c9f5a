"""`factorlab calibrate accel|gyro|imu` from files, as a user types it."""

import json
import subprocess
import sys

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from dwell_worlds import ACCEL_MATRIX, ACCEL_OFFSET, GYRO_MATRIX, attitudes, recorded

from factorlab.cli import main
from sequential.readers import write_imu
from sequential.sensors import SIX_POSITIONS, ImuCalibration, ImuRecording, calibration_hash


def run(*arguments):
    return CliRunner().invoke(main, ["calibrate", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings as files: many positions, others of the same sensor, six positions, one at rest."""
    place, rng = tmp_path_factory.mktemp("imu"), np.random.default_rng(5)
    for name, orientations in (
        ("many", attitudes(16, rng)),
        ("others", attitudes(6, rng)),
        ("six", SIX_POSITIONS),
        ("five", SIX_POSITIONS[:5]),
        ("rest", SIX_POSITIONS[:1]),
    ):
        dwell = 20.0 if name == "rest" else 2.0
        write_imu(recorded(orientations, rng, dwell=dwell)[0], place / f"{name}.csv")
    return place


def test_imu_with_report_files_and_a_trial(folder, tmp_path):
    out = tmp_path / "out"
    done = run("imu", folder / "many.csv", "--verify", folder / "others.csv", "--json", "-o", out, "--check")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["accel"]["leave_one_out_rms"] < 0.01
    assert document["verification"]["rms"] < 0.01
    assert len(document["verification"]["moves"]) == 5
    assert {one["verdict"] for one in document["verdicts"]} <= {"PASS", "INFO"}
    names = {"report.html", "report.json", "calibration.json", "calibration.h", "kalibr_imu.yaml"}
    assert {path.name for path in out.iterdir()} == names
    bundle = ImuCalibration.load(out / "calibration.json")
    np.testing.assert_allclose(bundle.accel.matrix, ACCEL_MATRIX, atol=2e-3)
    np.testing.assert_allclose(bundle.accel.offset, ACCEL_OFFSET, atol=1e-2)
    np.testing.assert_allclose(bundle.gyro.matrix, GYRO_MATRIX, atol=2e-3)
    header = (out / "calibration.h").read_text()
    assert f"HASH 0x{calibration_hash(bundle):08x}UL" in header
    assert "affine_q accel_calibration_q" in header
    assert yaml.safe_load((out / "kalibr_imu.yaml").read_text())["imu0"]["model"] == "scale-misalignment"
    page = (out / "report.html").read_text()
    assert page.count("<svg") == 6
    assert all(word in page for word in ("Constants", "Dwells", "Coverage", "Moves", "Timeline", "Tried on"))
    again = run("imu", folder / "many.csv", "-o", out)
    assert again.exit_code == 1
    assert "--force" in again.stderr


def test_a_header_for_the_firmware_alone(folder, tmp_path):
    header = tmp_path / "constants.h"
    done = run("gyro", folder / "rest.csv", "--c-header", header, "--json")
    assert done.exit_code == 0, done.stderr
    json.loads(done.stdout)
    assert "affine_q gyro_calibration_q" in header.read_text()
    again = run("gyro", folder / "rest.csv", "--c-header", header)
    assert again.exit_code == 1
    assert "--force" in again.stderr
    assert run("gyro", folder / "rest.csv", "--c-header", header, "--force").exit_code == 0
    lost = run("gyro", folder / "rest.csv", "--c-header", tmp_path / "no" / "c.h")
    assert lost.exit_code == 1
    assert "there is no folder" in lost.stderr


def test_the_same_numbers_on_the_screen(folder):
    done = run("accel", folder / "many.csv")
    assert done.exit_code == 0, done.stderr
    assert "PASS  |mean of a left-out dwell| − g, RMS" in done.stdout
    assert "misalignment zy" in done.stdout


def test_six_positions_in_one_file_or_in_six(folder, tmp_path):
    rng, files = np.random.default_rng(6), []
    for k, q in enumerate(SIX_POSITIONS):
        files.append(tmp_path / f"{k}.csv")
        write_imu(recorded(q[None], rng, dwell=4.0)[0], files[-1])
    for sources in ([folder / "six.csv"], files):
        done = run("accel", "--positions", "six", *sources, "--json")
        assert done.exit_code == 0, done.stderr
        found = {p["name"]: p["value"] for p in json.loads(done.stdout)["parameters"]}
        np.testing.assert_allclose([found[f"gain {a}"] for a in "xyz"], np.diag(ACCEL_MATRIX), atol=3e-3)
        assert "misalignment yx" not in found


def test_gravity_of_a_place(folder):
    done = [
        json.loads(run("accel", folder / "many.csv", "--json", *given).stdout)
        for given in ((), ("--latitude", "0"), ("--gravity", "9.81"))
    ]
    assert [round(one["gravity"], 5) for one in done] == [9.80665, 9.78033, 9.81]
    gains = [one["calibration"]["accel"]["matrix"][0][0] for one in done]
    assert gains[1] / gains[0] == pytest.approx(9.78033 / 9.80665, abs=1e-4)


def test_gyro_at_rest_and_by_turns(folder, tmp_path):
    done = run("gyro", folder / "rest.csv", "--json")
    assert done.exit_code == 0, done.stderr
    offsets = {p["name"]: p for p in json.loads(done.stdout)["parameters"]}
    assert offsets["offset x"]["interval"][0] < np.degrees(0.02) < offsets["offset x"]["interval"][1]
    rng = np.random.default_rng(7)
    speed = np.repeat([0.0, 0.8, 0.0, -0.8, 0.0], 200)[:, None] * [0.0, 1.0, 0.0]
    gyro = speed / 1.03 + 1e-3 * rng.standard_normal(speed.shape)
    accel = np.tile([0.0, 9.80665, 0.0], (len(gyro), 1)) + 0.01 * rng.standard_normal(speed.shape)
    write_imu(ImuRecording(np.arange(len(gyro)) * 0.01, accel, gyro), tmp_path / "turns.csv")
    degrees = np.degrees(1.6)
    done = run("gyro", tmp_path / "turns.csv", "--turn", f"y={degrees}", "--turn", f"y=-{degrees}", "--json")
    assert done.exit_code == 0, done.stderr
    found = {p["name"]: p for p in json.loads(done.stdout)["parameters"]}
    assert found["gain y"]["value"] == pytest.approx(1.03, abs=5e-3)
    assert found["gain y"]["interval"][1] - found["gain y"]["interval"][0] < 0.05
    assert not found["gain x"]["observed"]


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("accel", "{}/rest.csv"), 1, "1 dwells"),
        (("accel", "--positions", "six", "{}/five.csv"), 1, "z axis down"),
        (("imu", "{}/six.csv", "--dwell", "30"), 1, "nowhere still"),
        (("accel", "{}/many.csv", "--gravity", "9.8", "--latitude", "3"), 2, "twice"),
        (("accel", "{}/many.csv", "--height", "3"), 2, "--latitude"),
        (("gyro", "{}/many.csv", "--turn", "up=3"), 2, "no turn"),
        (("gyro", "{}/many.csv", "--turn", "x=90"), 1, "15 moves"),
        (("accel", "{}/none.csv"), 1, "none.csv"),
        (("accel",), 2, "LOG"),
    ],
)
def test_bad_input_is_one_sentence(folder, arguments, code, said):
    done = run(*(part.format(folder) for part in arguments))
    assert done.exit_code == code
    assert said in done.stderr
    assert not done.stdout
    assert "Traceback" not in done.stderr


def test_help_imports_nothing_heavy():
    script = (
        "import sys, contextlib\nfrom factorlab.cli import main\n"
        "with contextlib.suppress(SystemExit): main(['calibrate', '--help'])\n"
        "print({'numpy', 'scipy', 'matplotlib', 'numba'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("set()\n")
    assert "ferraris" in done.stdout


@pytest.mark.data
def test_mpu6050(data_dir):
    folder = data_dir / "imu" / "mpu6050"
    done = run(
        "imu", folder / "example_data_calibration.csv", "--verify", folder / "imu_90_x_rot.csv", "--json"
    )
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["accel"]["leave_one_out_rms"] < 0.01
    (move,) = document["verification"]["moves"]
    assert np.degrees(move["off"]) < 0.5
    assert len(document["accel"]["left_out"]) == 10
