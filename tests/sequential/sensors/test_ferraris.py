import json
from dataclasses import replace

import numpy as np
import pytest

from sequential.errors import DataError, MissingStreamError
from sequential.readers import read_imu
from sequential.readers.imu.sections import read_labels, read_section_list
from sequential.sensors import Ferraris, ImuRecording
from sequential.sensors.ferraris_sections import POSITIONS, SECTIONS, TURNS, find_sections
from sequential.sensors.ferraris_solution import SectionMeans, parameter_cov, solve

G, TURN, RATE = 9.81, -2 * np.pi, 100.0
K_A = np.array([[210.0, 3.0, -2.0], [1.5, 205.0, 4.0], [-3.0, 2.0, 215.0]])  # raw per m/s²
K_G = np.array([[940.0, 9.0, -5.0], [4.0, 950.0, 6.0], [-8.0, 3.0, 930.0]])  # raw per rad/s
K_GA = np.array([[0.02, -0.01, 0.0], [0.01, 0.03, -0.02], [0.0, 0.01, 0.02]])
B_A, B_G = np.array([-6.0, 48.0, -29.0]), np.array([2.0, -4.5, 3.7])


def small_turn(vector):
    x, y, z = vector
    return np.eye(3) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def session(rng, *, noise=4.0, tilt=0.0, turn_error=0.0, turn=TURN, dwell=200):
    """Six positions, then three turns with rest around them; the recording and its sections."""
    force, rate, sections, at = [], [], {}, 0

    def hold(name, up, spin=0.0):
        nonlocal at
        moved = small_turn(tilt * rng.standard_normal(3))
        axis = small_turn(tilt * rng.standard_normal(3)) @ np.abs(up)
        force.append(np.tile(moved @ up * G, (dwell, 1)))
        rate.append(np.tile(axis * spin, (dwell, 1)))
        if name:
            sections[name] = slice(at, at + dwell)
        at += dwell

    up = {name: np.eye(3)["xyz".index(name[0])] * (1 if name[2] == "p" else -1) for name in POSITIONS}
    for name in POSITIONS:
        hold(name, up[name])
    for name in TURNS:
        seconds = dwell / RATE
        hold("", up[f"{name[0]}_p"])
        hold(name, up[f"{name[0]}_p"], (turn + turn_error * rng.standard_normal()) / seconds)
        hold("", up[f"{name[0]}_p"])
    force, rate = np.vstack(force), np.vstack(rate)
    accel = force @ K_A.T + B_A + noise * rng.standard_normal(force.shape)
    gyro = rate @ K_G.T + force @ K_GA.T + B_G + noise * rng.standard_normal(force.shape)
    t = np.arange(len(force)) / RATE
    return ImuRecording(t, accel, gyro, accel_unit="counts", gyro_unit="counts"), sections


def test_truth_is_found_without_noise(rng):
    recording, sections = session(rng, noise=0.0)
    fit = Ferraris(gravity=G).calibrate(recording, sections)
    np.testing.assert_allclose(fit.accel_gain @ fit.accel_rotation, K_A, atol=1e-9)
    np.testing.assert_allclose(fit.gyro_gain @ fit.gyro_rotation, K_G, rtol=1e-9)
    np.testing.assert_allclose(fit.g_sensitivity, K_GA, atol=1e-12)
    np.testing.assert_allclose(fit.calibration.accel.offset, B_A, atol=1e-9)
    np.testing.assert_allclose(fit.calibration.gyro.offset, B_G, atol=1e-9)
    assert not fit.findings


def test_apply_gives_force_and_rate_back(rng):
    recording, sections = session(rng, noise=0.0)
    force, rate = Ferraris(gravity=G).calibrate(recording, sections).apply(recording.accel, recording.gyro)
    np.testing.assert_allclose(force[sections["y_a"]], np.tile([0, -G, 0], (200, 1)), atol=1e-9)
    turn = rate[sections["z_rot"]].sum(axis=0) / RATE
    np.testing.assert_allclose(turn, [0, 0, TURN], atol=1e-9)


def test_the_session_is_found_by_itself(rng):
    recording, sections = session(rng)
    found = find_sections(recording)
    assert tuple(found) == SECTIONS
    for name in TURNS:
        middle = (sections[name].start + sections[name].stop) // 2
        assert found[name][0] < middle < found[name][-1]
    given = Ferraris(gravity=G).calibrate(recording, sections)
    free = Ferraris(gravity=G).calibrate(recording)
    np.testing.assert_allclose(
        free.calibration.gyro.matrix, given.calibration.gyro.matrix, rtol=0.01, atol=1e-5
    )
    np.testing.assert_allclose(
        free.calibration.accel.matrix, given.calibration.accel.matrix, rtol=2e-3, atol=2e-5
    )


def test_covariance_is_that_of_many_sessions(rng):
    """Normalised errors of matrices and offsets, noise and crooked hands included."""
    tilt, turn_error = np.radians(0.5), np.radians(1.0)
    work = Ferraris(gravity=G, tilt_sigma=tilt, turn_sigma=turn_error)
    truth = np.r_[np.linalg.inv(K_A).ravel(), B_A, np.linalg.inv(K_G).ravel(), B_G, K_GA.ravel()]
    scores = []
    for _ in range(60):
        recording, sections = session(rng, tilt=tilt, turn_error=turn_error, dwell=100)
        data = SectionMeans.of(recording, {k: np.arange(v.start, v.stop) for k, v in sections.items()})
        found = solve(data, G, TURN)
        cov = parameter_cov(data, found, G, TURN, work.tilt_sigma, work.turn_sigma)
        scores.append((found.stacked - truth) / np.sqrt(np.diag(cov)))
    rms = np.sqrt(np.mean(np.square(scores), axis=0))
    # a matrix's diagonal bends with the square of a tilt, which first order does not see
    assert 0.8 < np.sqrt(np.mean(rms**2)) < 1.25
    assert rms.max() < 1.6
    assert rms.min() > 0.55


def test_wider_hands_make_wider_intervals(rng):
    recording, sections = session(rng)
    sigmas = [
        Ferraris(gravity=G, tilt_sigma=tilt)
        .calibrate(recording, sections)
        .calibration.accel.sigmas()[0][0, 1]
        for tilt in (0.0, 0.01, 0.02)
    ]
    assert sigmas[0] < sigmas[1] < sigmas[2]
    np.testing.assert_allclose(sigmas[2] / sigmas[1], 2, rtol=0.05)


def test_stamps_decide_about_a_turn(rng):
    recording, sections = session(rng, noise=0.0)
    twice = replace(recording, t=recording.t * 2)
    a = Ferraris(gravity=G).calibrate(recording, sections)
    b = Ferraris(gravity=G).calibrate(twice, sections)
    np.testing.assert_allclose(b.gyro_gain, 2 * a.gyro_gain, rtol=1e-6)


def test_reversed_turns_are_said(rng):
    recording, sections = session(rng, turn=-TURN)
    fit = Ferraris(gravity=G).calibrate(recording, sections)
    assert any("opposite sign" in f.what for f in fit.findings)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda s: {k: v for k, v in s.items() if k != "y_a"}, "missing: y_a"),
        (lambda s: s | {"w_p": slice(0, 9)}, "unknown section 'w_p'"),
        (lambda s: s | {"x_p": slice(0, 1)}, "three at least"),
        (lambda s: s | {"x_p": [10**6] * 5}, "of 3000"),
        (lambda s: s | {"x_p": s["x_a"], "x_a": s["x_p"]}, "exchanged"),
        (lambda s: s | {"x_p": s["y_p"], "x_a": s["y_a"], "y_p": s["x_p"], "y_a": s["x_a"]}, "exchanged"),
    ],
)
def test_wrong_sections_are_told(rng, change, sentence):
    recording, sections = session(rng)
    with pytest.raises(DataError, match=sentence):
        Ferraris(gravity=G).calibrate(recording, change(sections))


def test_a_missing_position_is_named(rng):
    recording, _ = session(rng)
    keep = np.ones(len(recording), dtype=bool)
    keep[200:400] = False  # x axis down
    with pytest.raises(DataError, match=r"x_a \(x axis down\)"):
        Ferraris(gravity=G).calibrate(recording.select(keep))


def test_a_dead_axis_is_named(rng):
    recording, sections = session(rng)
    gyro = recording.gyro.copy()
    gyro[:, 1] = 7.0
    with pytest.raises(DataError, match="gyro: axis y reads no turn"):
        Ferraris(gravity=G).calibrate(replace(recording, gyro=gyro), sections)


def test_a_gyro_is_needed(rng):
    recording, sections = session(rng)
    with pytest.raises(MissingStreamError, match="no gyro"):
        Ferraris().calibrate(replace(recording, gyro=None), sections)


@pytest.mark.parametrize("wrong", [{"gravity": 0.0}, {"turn": np.nan}, {"tilt_sigma": -1.0}])
def test_settings_are_checked(wrong):
    with pytest.raises(DataError, match=next(iter(wrong))):
        Ferraris(**wrong)


def test_imucal_expected_file(data_dir):
    """The expected calibration of imucal's annotated session, to 1e-6."""
    folder = data_dir / "imu" / "imucal"
    path = folder / "annotated_session.csv"
    recording = read_imu(path, rate=204.8, units="accel=counts,gyro=counts")
    ours = Ferraris(gravity=9.81).calibrate(recording, read_labels(path)).to_imucal()
    expected = json.loads((folder / "example_cal.json").read_text())
    assert set(ours) == set(expected)
    for name, value in expected.items():
        if isinstance(value, list):
            np.testing.assert_allclose(ours[name], value, rtol=0, atol=1e-6, err_msg=name)
        else:
            assert ours[name] == value


def test_imucal_itself_on_the_other_session(data_dir):
    """The package, run on a session of which no expected file exists."""
    import imucal

    folder = data_dir / "imu" / "imucal"
    recording = read_imu(folder / "example_ferraris_session.csv", rate=102.4, units="accel=m/s^2,gyro=deg/s")
    sections = read_section_list(folder / "example_ferraris_session_list.json")
    ours = Ferraris(gravity=9.81).calibrate(recording, sections)
    parts = {
        f"{kind}_{name}": np.asarray(values[rows])
        for name, rows in sections.items()
        for kind, values in (("acc", recording.accel), ("gyr", np.degrees(recording.gyro)))
    }
    theirs = imucal.FerrarisCalibration(grav=9.81).compute(
        imucal.FerrarisSignalRegions(**parts), 102.4, from_acc_unit="m/s^2", from_gyr_unit="deg/s"
    )
    scale = np.degrees(1.0)
    np.testing.assert_allclose(ours.accel_gain @ ours.accel_rotation, theirs.K_a @ theirs.R_a, atol=1e-9)
    np.testing.assert_allclose(ours.gyro_gain @ ours.gyro_rotation, theirs.K_g @ theirs.R_g, atol=1e-6)
    np.testing.assert_allclose(ours.g_sensitivity * scale, theirs.K_ga, atol=1e-9)
    np.testing.assert_allclose(ours.calibration.gyro.offset * scale, theirs.b_g, atol=1e-9)


def test_the_real_session_is_found_by_itself(data_dir):
    folder = data_dir / "imu" / "imucal"
    recording = read_imu(folder / "example_ferraris_session.csv", rate=102.4, units="accel=m/s^2,gyro=deg/s")
    given = read_section_list(folder / "example_ferraris_session_list.json")
    found = find_sections(recording)
    for name, rows in given.items():
        assert found[name][0] < rows.start + 60, name
        assert found[name][-1] > rows.stop - 60, name
    by_hand, alone = (Ferraris().calibrate(recording, one).calibration for one in (given, None))
    np.testing.assert_allclose(alone.gyro.matrix, by_hand.gyro.matrix, atol=5e-4)
    np.testing.assert_allclose(alone.accel.matrix, by_hand.accel.matrix, atol=2e-4)
