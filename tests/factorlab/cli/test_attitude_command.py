"""What `factorlab attitude` prints, writes and returns, for recordings whose truth is known."""

import json

import numpy as np
import pytest
from attitude_worlds import seen, still, swinging
from click.testing import CliRunner

from factorlab.attitude import available
from factorlab.cli import main
from factorlab.cli.attitude import FILTERS
from sequential.attitude import attitude_from_angles
from sequential.evaluate import Trajectory
from sequential.manifold.quaternion import quaternion_multiply
from sequential.readers import read_tum, write_tum
from sequential.sensors import AffineCalibration, ImuCalibration

HEADER = "t,ax,ay,az,gx,gy,gz,mx,my,mz"
UNITS = ("--units", "accel=m/s^2,gyro=rad/s,mag=uT,t=s")


def run(*arguments):
    return CliRunner().invoke(main, ["attitude", *map(str, arguments)])


def save(path, recording):
    """The recording as a CSV with nine columns and stamps, six without magnetometer."""
    parts = [recording.seconds[:, None], recording.accel, recording.gyro]
    names = HEADER.split(",")
    if recording.mag is not None:
        parts.append(recording.mag)
    table = np.hstack(parts)
    np.savetxt(path, table, delimiter=",", header=",".join(names[: table.shape[1]]), comments="", fmt="%.9g")
    return path


@pytest.fixture
def moved(tmp_path, rng):
    """A recording of a slow motion, and the truth of it."""
    t, angles = swinging(20.0)
    truth = attitude_from_angles(angles)
    write_tum(tmp_path / "truth.tum", Trajectory(t, np.zeros((len(t), 3)), truth))
    return save(tmp_path / "moved.csv", seen(t, truth, rng=rng)), tmp_path / "truth.tum", angles


def test_the_names_are_those_of_the_library():
    from factorlab.attitude.estimators import CLASSES

    assert tuple(CLASSES) == FILTERS
    assert set(available()) <= set(FILTERS)


@pytest.mark.parametrize("name", available())
def test_every_filter_finds_the_attitude(moved, name):
    log, truth, angles = moved
    done = run(log, *UNITS, "--filter", name, "--truth", truth, "--json")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert whole["filter"] == name
    found = whole["filters"][name]
    assert found["error_deg"]["total"] < 1.5
    assert found["final_deg"]["roll"] == pytest.approx(np.degrees(angles[-1, 0]), abs=2.0)
    assert ("nees" in found) == (name in {"error-state", "smoother", "kalman", "c-error-state"})


def test_the_report_and_the_orientation_are_written(moved, tmp_path):
    log, truth, angles = moved
    out = tmp_path / "out"
    done = run(
        log, *UNITS, "--filter", "kalman", "--compare", "mahony, madgwick", "--truth", truth, "-o", out
    )
    assert done.exit_code == 0, done.stderr
    page = (out / "report.html").read_text(encoding="utf-8")
    for word in ("Roll, pitch and yaw", "Against the truth", "Gyro bias", "tilt Kalman", "Madgwick", "<svg"):
        assert word in page
    assert "http" not in page.split("<body")[1].split("</body")[0].replace("http://www.w3.org", "")
    table = np.genfromtxt(out / "orientation.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["roll_deg"][-1], np.degrees(angles[-1, 0]), atol=2.0)
    assert {"sigma_yaw_deg", "bias_z_rad_s"} <= set(table.dtype.names)
    other = read_tum(out / "orientation.tum")
    quaternion = np.column_stack([table[name] for name in ("qw", "qx", "qy", "qz")])
    np.testing.assert_allclose(other.quaternion, quaternion, atol=1e-6)
    assert (out / "orientation_mahony.tum").is_file()
    assert json.loads((out / "report.json").read_text())["filters"].keys() == {"kalman", "mahony", "madgwick"}
    again = run(log, *UNITS, "-o", out)
    assert again.exit_code == 1
    assert "--force" in again.stderr


def test_without_field_or_with_no_mag_it_is_6d(moved, tmp_path, rng):
    log, truth, _ = moved
    t, angles = swinging(20.0)
    six = save(tmp_path / "six.csv", seen(t, attitude_from_angles(angles), mag=False, rng=rng))
    for arguments in ((six,), (log, "--no-mag")):
        done = run(*arguments, *UNITS, "--filter", "mahony", "--truth", truth, "--json")
        assert done.exit_code == 0, done.stderr
        whole = json.loads(done.stdout)
        assert not whole["recording"]["magnetometer"]
        assert "6-D" in whole["lead"]
        assert whole["filters"]["mahony"]["error_deg"]["total"] < 1.5


def test_a_truth_with_another_north_is_turned(moved, tmp_path):
    log, truth, _ = moved
    given = read_tum(truth)
    east = quaternion_multiply(attitude_from_angles([0.0, 0.0, 1.5]), given.quaternion)
    write_tum(tmp_path / "east.tum", Trajectory(given.t, given.position, east))
    done = run(log, *UNITS, "--filter", "mahony", "--truth", tmp_path / "east.tum", "--json")
    error = json.loads(done.stdout)["filters"]["mahony"]["error_deg"]
    assert error["total"] < 1.5
    assert error["heading_offset"] == pytest.approx(np.degrees(-1.5), abs=2.0)
    assert "another direction" in json.loads(done.stdout)["lead"]


def test_constants_are_applied_first(tmp_path, rng):
    recording = still((0.3, -0.2, 0.5), 10.0, rng=rng)
    bent = save(tmp_path / "bent.csv", type(recording)(
        recording.t, recording.accel * 1.05 + [0.4, -0.3, 0.2], recording.gyro, recording.mag
    ))  # fmt: skip
    constants = AffineCalibration(np.eye(3) / 1.05, [0.4, -0.3, 0.2], None, "accel", "m/s^2", "m/s^2", 0.0)
    ImuCalibration(accel=constants).save(tmp_path / "constants.json")
    tilts = []
    for options in ((), ("--calibration", tmp_path / "constants.json")):
        done = run(bent, *UNITS, "--filter", "mahony", "--json", *options)
        assert done.exit_code == 0, done.stderr
        final = json.loads(done.stdout)["filters"]["mahony"]["final_deg"]
        tilts.append([final["roll"], final["pitch"]])
    expected = np.degrees([0.3, -0.2])
    assert np.abs(np.array(tilts[0]) - expected).max() > 1.0
    np.testing.assert_allclose(tilts[1], expected, atol=0.3)


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (("--filter", "ekf"), 2, "ekf"),
        (("--compare", "mahoni"), 2, "did you mean 'mahony'"),
        (("--truth", "none.tum"), 1, "none.tum"),
        (("--calibration", "none.json"), 1, "none.json"),
        (("--truth", "truth.tum", "--no-truth"), 2, "contradict"),
    ],
)
def test_mistakes_end_in_a_sentence(moved, options, code, said):
    done = run(moved[0], *UNITS, *options)
    assert done.exit_code == code
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_a_truth_of_another_time_is_refused(moved, tmp_path):
    given = read_tum(moved[1])
    write_tum(tmp_path / "late.tum", Trajectory(given.t + 10**12, given.position, given.quaternion))
    done = run(moved[0], *UNITS, "--truth", tmp_path / "late.tum")
    assert done.exit_code == 1
    assert "shares no time" in done.stderr


def test_a_magnetometer_that_is_stuck_fails_until_it_is_left_out(tmp_path, rng):
    t, angles = swinging(20.0)
    recording = seen(t, attitude_from_angles(angles), rng=rng)
    stuck = save(tmp_path / "stuck.csv", type(recording)(
        recording.t, recording.accel, recording.gyro, np.tile([10.0, 20.0, -40.0], (len(recording), 1))
    ))  # fmt: skip
    refused = run(stuck, *UNITS)
    assert refused.exit_code == 1
    assert "magnetometer" in refused.stderr
    assert run(stuck, *UNITS, "--filter", "mahony", "--no-mag").exit_code == 0


def test_broad_has_its_truth(data_dir):
    done = run("broad:16", "--filter", "mahony", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["filters"]["mahony"]["error_deg"]["total"] == pytest.approx(1.5, abs=0.2)
    assert "error_deg" not in run("broad:16", "--filter", "mahony", "--json", "--no-truth").stdout
