"""EuRoC, RepoIMU, BROAD's originals, IMU-TK's texts and our own logs, written in their layout."""

import sys

import h5py
import numpy as np
import pytest
import scipy.io

from sequential.errors import DataError, FileFormatError
from sequential.noise import ImuNoise
from sequential.readers import read_broad, read_imu, read_kalibr_imu, read_repoimu, write_log
from sequential.sensors import simulate_imu, tumble

RATE = 200.0


@pytest.fixture
def truth(rng):
    return simulate_imu(tumble(10.0, rng, rest=2.0), rng, rate=RATE).truth


# --- EuRoC ---


@pytest.fixture
def euroc(tmp_path, truth):
    folder = tmp_path / "V1_01" / "mav0" / "imu0"
    folder.mkdir(parents=True)
    head = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]"
    lines = [f"{head},a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"]
    for t, w, a in zip(truth.t, truth.angular_rate.tolist(), truth.specific_force.tolist(), strict=True):
        lines.append(",".join([str(1_403_636_579_758_555_392 + int(t)), *map(repr, w), *map(repr, a)]))
    (folder / "data.csv").write_text("\r\n".join(lines) + "\r\n")
    (folder / "sensor.yaml").write_text(
        "#Default imu sensor yaml file\nsensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\nrate_hz: 200\n"
        "gyroscope_noise_density: 1.6968e-04  # [ rad / s / sqrt(Hz) ]\ngyroscope_random_walk: 1.9393e-05\n"
        "accelerometer_noise_density: 2.0000e-3\naccelerometer_random_walk: 3.0000e-3\n"
    )
    return tmp_path / "V1_01"


def test_euroc(euroc, truth):
    for path in (euroc, euroc / "mav0", euroc / "mav0" / "imu0", euroc / "mav0" / "imu0" / "data.csv"):
        imu = read_imu(path)
        np.testing.assert_array_equal(imu.gyro, truth.angular_rate)
        np.testing.assert_array_equal(imu.accel, truth.specific_force)
        np.testing.assert_array_equal(imu.t - truth.t, 1_403_636_579_758_555_392)
        assert imu.findings == ()
    assert read_imu(euroc).name == "V1_01"


def test_noise_of_euroc(euroc):
    stated = read_kalibr_imu(euroc / "mav0" / "imu0" / "sensor.yaml")
    assert stated.noise == ImuNoise(1.6968e-4, 2e-3, 1.9393e-5, 3e-3)
    assert stated.rate == 200.0


# --- RepoIMU ---


@pytest.fixture
def repoimu(tmp_path, truth):
    lines = [
        "Time (s);Vicon Orientation;;;;IMU Acceleration;;;IMU Gyroscope;;;IMU Magnetometer;;;",
        ";W;X;Y;Z;X;Y;Z;X;Y;Z;X;Y;Z;",
    ]
    for k, t in enumerate(truth.t):
        q = np.zeros(4) if 100 <= k < 120 else truth.world_q_body[k]
        row = [
            t * 1e-9 + 0.06,
            *q,
            *truth.specific_force[k],
            *truth.angular_rate[k],
            *(truth.field[k] / 47.0),
        ]
        lines.append(";".join(f"{value:.9g}" for value in row))
    path = tmp_path / "TStick_Test02_Trial1.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_repoimu(repoimu, truth):
    imu, world_q_body = read_repoimu(repoimu)
    np.testing.assert_allclose(imu.accel, truth.specific_force, atol=1e-7)
    np.testing.assert_allclose(imu.gyro, truth.angular_rate, atol=1e-7)
    assert imu.mag_unit == "counts"
    gap = np.isnan(world_q_body).all(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(gap), np.arange(100, 120))
    np.testing.assert_allclose(world_q_body[~gap], truth.world_q_body[~gap], atol=1e-8)
    np.testing.assert_array_equal(read_imu(repoimu).accel, imu.accel)


def test_repoimu_is_told_from_others(tmp_path):
    (tmp_path / "x.csv").write_text("t,ax,ay,az\n0,0,0,9.8\n")
    with pytest.raises(FileFormatError, match="is no trial of RepoIMU"):
        read_repoimu(tmp_path / "x.csv")


# --- BROAD as published ---


@pytest.fixture
def trial(truth):
    moving = ~truth.rest
    seen = truth.world_q_body.copy()
    seen[50:60] = np.nan
    return {
        "imu_gyr": truth.angular_rate,
        "imu_acc": truth.specific_force,
        "imu_mag": truth.field,
        "opt_quat": seen,
        "opt_pos": np.zeros((len(seen), 3)),
        "movement": moving.astype(np.uint8),
        "sampling_rate": RATE,
    }


def assert_is_trial(path, trial):
    imu, seen = read_broad(path)
    np.testing.assert_allclose(imu.gyro, trial["imu_gyr"])
    np.testing.assert_allclose(imu.accel, trial["imu_acc"])
    np.testing.assert_allclose(imu.mag, trial["imu_mag"])
    np.testing.assert_allclose(seen.world_q_body, trial["opt_quat"], atol=1e-12)
    np.testing.assert_array_equal(seen.movement, trial["movement"].astype(bool))
    assert imu.rate == pytest.approx(RATE)
    np.testing.assert_array_equal(read_imu(path).gyro, imu.gyro)


def test_broad_mat(tmp_path, trial):
    path = tmp_path / "02_undisturbed.mat"
    scipy.io.savemat(path, trial)
    assert_is_trial(path, trial)


def test_broad_hdf5(tmp_path, trial):
    path = tmp_path / "02_undisturbed.hdf5"
    with h5py.File(path, "w") as file:
        for name, values in trial.items():
            if name == "sampling_rate":
                file.attrs[name] = values
            else:
                file.create_dataset(name, data=values)
    assert_is_trial(path, trial)


def test_broad_hdf5_needs_h5py(tmp_path, monkeypatch):
    (tmp_path / "x.hdf5").write_bytes(b"anything")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(DataError, match=r"pip install 'factorlab\[hdf5\]'"):
        read_broad(tmp_path / "x.hdf5")


@pytest.mark.parametrize("name", ["x.mat", "x.hdf5"])
def test_files_that_only_have_the_name(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x01garbage" * 40)
    with pytest.raises(FileFormatError, match=r"is not an? (MAT|HDF5)"):
        read_broad(tmp_path / name)


def test_another_mat_file(tmp_path):
    scipy.io.savemat(tmp_path / "x.mat", {"foo": np.eye(3)})
    with pytest.raises(FileFormatError, match="lacks imu_gyr, imu_acc"):
        read_imu(tmp_path / "x.mat")


# --- IMU-TK ---


@pytest.fixture
def imu_tk(tmp_path, truth):
    force, rate = truth.specific_force * 100 + 32768, truth.angular_rate * 1000 + 32768
    for name, values in (("acc", force), ("gyro", rate)):
        table = np.column_stack([truth.t * 1e-9 + 0.03, values])
        np.savetxt(tmp_path / f"xsens_{name}.mat", table, fmt=["   %.6f", "%.0f", "%.0f", "%.0f"])
    return tmp_path


def test_imu_tk(imu_tk, truth):
    for path in (imu_tk, imu_tk / "xsens_acc.mat", imu_tk / "xsens_gyro.mat"):
        imu = read_imu(path)
        assert (imu.accel_unit, imu.gyro_unit) == ("counts", "counts")
        np.testing.assert_allclose(imu.accel, np.round(truth.specific_force * 100 + 32768))
        assert imu.rate == pytest.approx(RATE)
        assert path.is_dir() or imu.name == "xsens"


def test_imu_tk_with_two_recordings(imu_tk):
    (imu_tk / "phone_acc.mat").write_text((imu_tk / "xsens_acc.mat").read_text())
    with pytest.raises(FileFormatError, match="holds several recordings"):
        read_imu(imu_tk)
    assert read_imu(imu_tk / "phone_acc.mat").sensors == ("accel",)


# --- our own logs and other archives ---


@pytest.mark.parametrize("name", ["log.npz", "log.csv"])
def test_logs_of_this_project(tmp_path, truth, rng, name):
    recording = simulate_imu(tumble(3.0, rng), rng, mag_every=3, temperature=20.0).recording
    write_log(tmp_path / name, recording.to_log())
    again = read_imu(tmp_path / name)
    for field in ("t", "accel", "gyro", "mag"):
        np.testing.assert_array_equal(getattr(again, field), getattr(recording, field))


def test_archives_of_arrays(tmp_path, truth):
    np.savez(tmp_path / "x.npz", t=truth.t * 1e-9, acc=truth.specific_force, gyr=truth.angular_rate)
    imu = read_imu(tmp_path / "x.npz")
    np.testing.assert_array_equal(imu.gyro, truth.angular_rate)
    assert imu.rate == pytest.approx(RATE)
    np.savez(tmp_path / "y.npz", acc=truth.specific_force)
    with pytest.raises(FileFormatError, match="no array t and no rate"):
        read_imu(tmp_path / "y.npz")
    assert read_imu(tmp_path / "y.npz", rate=50.0).rate == pytest.approx(50.0)
    np.savez(tmp_path / "z.npz", foo=truth.specific_force)
    with pytest.raises(FileFormatError, match="holds the arrays foo; expected are acc and gyr"):
        read_imu(tmp_path / "z.npz")
    np.savez(tmp_path / "w.npz", acc=truth.specific_force, gyr=truth.angular_rate[:5], rate=100.0)
    with pytest.raises(FileFormatError, match="gyro has 5 rows"):
        read_imu(tmp_path / "w.npz")
