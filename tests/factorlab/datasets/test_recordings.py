"""Recordings by name and by path, with the truth that came along."""

import numpy as np
import pytest

from factorlab.datasets.recordings import RECORDINGS, open_recording
from sequential.errors import DataError
from sequential.readers import write_imu
from sequential.sensors import ImuRecording, simulate_imu, tumble


def test_trials_of_broad_by_number(data_dir):
    opened = open_recording("broad:07")
    assert opened.path.stem == "07_undisturbed_fast_rotation_B"
    assert opened.truth.world_q_body.shape == (len(opened.recording), 4)
    assert opened.truth.movement.any()


def test_every_set_that_is_there_opens(data_dir):
    for name in RECORDINGS:
        for path in (data_dir / "imu" / name).glob("*.[cn][sp][vz]"):
            assert len(open_recording(f"{name}:{path.stem}").recording) > 10
            if path.parent.name != "imucal":
                assert open_recording(path).recording.rate > 10.0


def test_a_set_of_one_needs_no_part(data_dir):
    assert open_recording("xio").recording.rate == pytest.approx(99.21, abs=0.1)
    assert open_recording("imucal:ferraris_example").recording.rate == pytest.approx(102.4)


def test_several_fit(data_dir):
    with pytest.raises(DataError, match=r"names 2 recordings of mpu6050; it has mpu6050:example_data_cal"):
        open_recording("mpu6050:example")
    with pytest.raises(DataError, match=r"names no recording of broad; it has broad:01"):
        open_recording("broad:99")


def test_names_that_are_unknown(tmp_path, monkeypatch):
    with pytest.raises(DataError, match="did you mean 'broad'"):
        open_recording("brood:07")
    monkeypatch.setenv("FACTORLAB_DATA", str(tmp_path))
    with pytest.raises(DataError, match="set FACTORLAB_DATA to the folder that holds imu/broad"):
        open_recording("broad:07")


def test_the_truth_of_repoimu(tmp_path, rng):
    imu, truth = simulate_imu(tumble(5.0, rng), rng)
    groups = "Time (s);Vicon Orientation;;;;IMU Acceleration;;;IMU Gyroscope;;;IMU Magnetometer;;;"
    table = np.column_stack([imu.seconds, truth.world_q_body, imu.accel, imu.gyro, imu.mag / 47.0])
    header = f"{groups}\n;W;X;Y;Z;X;Y;Z;X;Y;Z;X;Y;Z;"
    np.savetxt(tmp_path / "TStick.csv", table, delimiter=";", header=header, comments="")
    opened = open_recording(tmp_path / "TStick.csv")
    np.testing.assert_allclose(opened.truth.world_q_body, truth.world_q_body, atol=1e-12)
    assert opened.truth.movement.all()


def test_the_truth_of_euroc(tmp_path, rng):
    imu, truth = simulate_imu(tumble(5.0, rng), rng, rate=200.0, field=None)
    folder = tmp_path / "V1_01" / "mav0"
    for part in ("imu0", "state_groundtruth_estimate0"):
        (folder / part).mkdir(parents=True)
    head = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]"
    lines = [f"{head},a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"]
    for t, w, a in zip(imu.t.tolist(), imu.gyro.tolist(), imu.accel.tolist(), strict=True):
        lines.append(",".join(map(repr, (t, *w, *a))))
    (folder / "imu0" / "data.csv").write_text("\n".join(lines))
    head = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
    attitudes = zip(truth.t.tolist(), truth.world_q_body.tolist(), strict=True)
    rows = [f"{t + 1000},0,0,0,{','.join(map(repr, q))}" for t, q in attitudes]
    (folder / "state_groundtruth_estimate0" / "data.csv").write_text("\n".join([head, *rows[100:]]))
    opened = open_recording(tmp_path / "V1_01")
    seen = opened.truth.movement
    assert not seen[:99].any()
    assert seen[100:].all()
    np.testing.assert_allclose(opened.truth.world_q_body[100:], truth.world_q_body[100:], atol=1e-12)


def test_a_file_of_ones_own(tmp_path):
    rng = np.random.default_rng(4)
    t, accel = np.arange(100) * 0.01, [0, 0, 9.81] + 0.1 * rng.normal(size=(100, 3))
    write_imu(ImuRecording(t, accel), tmp_path / "mine.csv")
    opened = open_recording(tmp_path / "mine.csv")
    assert opened.truth is None
    np.testing.assert_array_equal(opened.recording.accel, accel)
    with pytest.raises(DataError, match=r"did you mean '.*mine\.csv'"):
        open_recording(tmp_path / "mime.csv")
