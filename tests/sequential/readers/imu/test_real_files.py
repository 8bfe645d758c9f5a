"""The recordings under FACTORLAB_DATA: formats found out, units told rightly, nothing asked of the user."""

import numpy as np
import pytest

from sequential.errors import FileFormatError
from sequential.readers import read_imu

G = 9.80665


@pytest.fixture
def folder(data_dir):
    return data_dir / "imu"


def at_rest(recording, seconds):
    return recording.slice(0.0, seconds)


@pytest.mark.parametrize(
    ("name", "samples"),
    [
        ("example_data_tinit_calc", 44930),
        ("example_data_calibration", 10245),
        ("imu_90_x_rot", 9987),
        ("imu_static_test", 9986),
    ],
)
def test_mpu6050(folder, name, samples):
    imu = read_imu(folder / "mpu6050" / f"{name}.csv")
    assert len(imu) == samples
    assert imu.rate == pytest.approx(100.0)
    still = at_rest(imu, 10.0)
    assert np.linalg.norm(still.accel.mean(axis=0)) == pytest.approx(G, rel=0.1)
    assert np.rad2deg(np.abs(still.gyro.mean(axis=0))).max() < 5.0
    told = read_imu(folder / "mpu6050" / f"{name}.csv", kind="mpu6050")
    np.testing.assert_allclose(told.accel, imu.accel)
    np.testing.assert_allclose(told.gyro, imu.gyro)


def test_the_turn_of_90_degrees(folder):
    imu = read_imu(folder / "mpu6050" / "imu_90_x_rot.csv")
    bias = at_rest(imu, 5.0).gyro.mean(axis=0)
    turned = np.rad2deg(((imu.gyro - bias) * 0.01).sum(axis=0))
    assert turned[0] == pytest.approx(90.0, abs=12.0)  # before calibration


def test_counts_on_request(folder):
    imu = read_imu(folder / "mpu6050" / "imu_static_test.csv", units="accel=counts,gyro=counts")
    assert (imu.accel_unit, imu.gyro_unit) == ("counts", "counts")
    np.testing.assert_array_equal(imu.accel[0], [748, 244, 15708])
    assert not [f for f in imu.findings if "taken as" in f.what]


def test_gyro_range_from_the_readings(folder):
    """The calibration recording turns, so the sensitivity is told by gravity and is no mere default."""
    said = [str(f) for f in read_imu(folder / "mpu6050" / "example_data_calibration.csv").findings]
    assert any("131 LSB" in text and "turns gravity" in text for text in said)


def test_xio(folder):
    imu = read_imu(folder / "xio" / "sensor_data.csv")
    assert imu.sensors == ("accel", "gyro", "mag")
    assert not imu.findings  # the header states everything
    assert imu.accel[0] == pytest.approx([0.001015204 * G, -0.02045836 * G, 0.9970807 * G])
    assert imu.gyro[0, 1] == pytest.approx(np.deg2rad(-0.1517251))
    assert imu.mag[0, 2] == pytest.approx(-41.06483)
    assert imu.t[1] == 10_078_907


def test_imu_tk(folder):
    imu = read_imu(folder / "imu_tk" / "xsens.npz")
    assert (imu.accel_unit, imu.gyro_unit) == ("counts", "counts")
    assert imu.accel[0] == pytest.approx([33108, 33329, 36429])
    assert imu.t[0] == 29_840_000


def test_imucal(folder):
    path = folder / "imucal" / "example_ferraris_session.csv"
    with pytest.raises(FileFormatError, match=r"no time column and no rate; give rate=100"):
        read_imu(path)
    imu = read_imu(path, rate=102.4)
    assert imu.rate == pytest.approx(102.4)
    assert imu.accel[0, 0] == pytest.approx(10.332114257812501)
    assert imu.gyro[0, 0] == pytest.approx(np.deg2rad(-0.6103515625))


def test_imucal_parts_are_put_in_order(folder):
    imu = read_imu(folder / "imucal" / "annotated_session.csv", rate=102.4)
    assert imu.accel_unit == "m/s^2"
    assert imu.gyro_unit == "counts"  # turned about the vertical: gravity does not tell its scale
    assert (np.diff(imu.t) > 0).all()


def test_qmc5883l(folder):
    imu = read_imu(folder / "qmc5883l" / "noisy_raw_data.csv")
    assert (imu.sensors, imu.mag_unit) == (("mag",), "counts")
    assert imu.rate == pytest.approx(50.0)
    assert imu.mag[0] == pytest.approx([6242, 980, 3872])
    in_field = read_imu(folder / "qmc5883l" / "noisy_raw_data.csv", units="mag=±8 G")
    assert in_field.mag[0, 0] == pytest.approx(6242 / 3000 * 100)


def test_vqf(folder):
    imu = read_imu(folder / "vqf" / "imu_data.npz")
    assert (imu.accel_unit, imu.gyro_unit, imu.mag_unit) == ("m/s^2", "rad/s", "uT")
    assert imu.rate == pytest.approx(2000 / 7)
    np.testing.assert_allclose(imu.gyro[0], [0.00213105, 0.00106465, -0.00213105], rtol=1e-5)


def test_broad(folder):
    for path in sorted((folder / "broad").glob("0*.npz")):
        imu = read_imu(path)
        assert imu.rate == pytest.approx(2000 / 7)
        assert np.median(np.linalg.norm(imu.accel, axis=1)) == pytest.approx(G, rel=0.02)
