import subprocess

import numpy as np
import pytest
import yaml

from sequential.errors import DataError, FileFormatError, NotFiniteError, ShapeError
from sequential.sensors import AffineCalibration, ImuCalibration, ImuRecording, c_header, kalibr_yaml


def some(rng, kind="accel", *, cov=True):
    matrix = np.diag(rng.uniform(0.5, 2.0, 3)) @ (np.eye(3) + 0.05 * rng.standard_normal((3, 3)))
    root = rng.standard_normal((12, 12))
    units = {"accel": ("counts", "m/s^2"), "gyro": ("counts", "rad/s"), "mag": ("counts", "uT")}[kind]
    return AffineCalibration(
        matrix, rng.standard_normal(3), root @ root.T if cov else None, kind, *units, 0.01, "a file"
    )


def same(a, b):
    np.testing.assert_array_equal(a.matrix, b.matrix)
    np.testing.assert_array_equal(a.offset, b.offset)
    assert (a.cov is None) == (b.cov is None)
    if a.cov is not None:
        np.testing.assert_array_equal(a.cov, b.cov)
    for name in ("kind", "unit_in", "unit_out", "residual_rms", "source"):
        assert getattr(a, name) == getattr(b, name)


def test_apply_is_the_equation_and_raw_goes_back(rng):
    one, raw = some(rng), rng.standard_normal((7, 5, 3))
    calibrated = one.apply(raw)
    np.testing.assert_allclose(calibrated[2, 3], one.matrix @ (raw[2, 3] - one.offset), rtol=1e-13)
    np.testing.assert_allclose(one.raw(calibrated), raw, rtol=1e-11, atol=1e-11)


def test_int16_counts_do_not_wrap_round():
    one = AffineCalibration(np.eye(3), np.full(3, -100.0))
    np.testing.assert_array_equal(one.apply(np.full((1, 3), 32767, np.int16)), [[32867.0] * 3])


@pytest.mark.parametrize("cov", [True, False])
def test_json_there_and_back(rng, cov):
    one = some(rng, cov=cov)
    same(AffineCalibration.from_json(one.to_json()), one)


def test_a_bundle_saved_and_loaded(rng, tmp_path):
    imu = ImuCalibration(some(rng), some(rng, "gyro"), None)
    again = ImuCalibration.load(imu.save(tmp_path / "calibration.json"))
    same(again.accel, imu.accel)
    same(again.gyro, imu.gyro)
    assert again.mag is None
    merged = again.merged(ImuCalibration(mag=some(rng, "mag")))
    assert [one.kind for one in merged.present] == ["accel", "gyro", "mag"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1]", "JSON object"),
        ("{", "not JSON"),
        ('{"schema": "other"}', "schema"),
        ('{"schema": "factorlab-imu-calibration", "version": 99}', "version 99"),
        ('{"schema": "factorlab-imu-calibration", "version": 1, "accel": {"matrix": 3}}', "matrix"),
        ('{"schema": "factorlab-imu-calibration", "version": 1, "accel": 3}', "needs kind"),
    ],
)
def test_malformed_files_are_named(tmp_path, text, said):
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=said):
        ImuCalibration.load(path)


def test_malformed_calibrations_are_refused(rng):
    with pytest.raises(ShapeError, match=r"accel\.matrix"):
        AffineCalibration(np.eye(2), np.zeros(3))
    with pytest.raises(NotFiniteError, match=r"accel\.offset"):
        AffineCalibration(np.eye(3), np.full(3, np.nan))
    with pytest.raises(DataError, match="inverted"):
        AffineCalibration(np.diag([1.0, 1.0, 0.0]), np.zeros(3))
    with pytest.raises(DataError, match="kind"):
        AffineCalibration(np.eye(3), np.zeros(3), kind="radar")
    with pytest.raises(DataError, match="gyro"):
        ImuCalibration(accel=some(rng, "gyro"))
    with pytest.raises(ShapeError, match="readings"):
        some(rng).apply(np.zeros((4, 2)))


def test_counts_take_the_nominal_scale_in(rng):
    one, counts = some(rng), rng.integers(-1000, 1000, (50, 3))
    by_count = one.with_counts(0.25)
    np.testing.assert_allclose(by_count.apply(counts), one.apply(0.25 * counts), rtol=1e-12, atol=1e-9)
    # the variance of a calibrated reading is the same number either way
    x = 0.25 * counts[0]

    def jacobian(c, reading):
        return np.hstack([np.kron(np.eye(3), reading - c.offset), -c.matrix])

    there, here = jacobian(by_count, counts[0]), jacobian(one, x)
    np.testing.assert_allclose(there @ by_count.cov @ there.T, here @ one.cov @ here.T, rtol=1e-10)


def test_a_bundle_calibrates_a_recording(rng):
    imu = ImuCalibration(some(rng), some(rng, "gyro"))
    counts = rng.integers(-1000, 1000, (20, 6)).astype(float)
    raw = ImuRecording(
        np.arange(20) * 0.01, counts[:, :3], counts[:, 3:], accel_unit="counts", gyro_unit="counts"
    )
    done = imu.apply(raw)
    np.testing.assert_array_equal(done.accel, imu.accel.apply(counts[:, :3]))
    np.testing.assert_array_equal(done.gyro, imu.gyro.apply(counts[:, 3:]))
    assert (done.accel_unit, done.gyro_unit) == ("m/s^2", "rad/s")
    with pytest.raises(DataError, match="takes counts"):
        imu.apply(done)


def test_c_header_compiles_and_calibrates(rng, tmp_path, c_compiler):
    imu = ImuCalibration(some(rng), some(rng, "gyro"), some(rng, "mag"))
    text = c_header(imu, source="a */ trap\nof two lines")
    assert text.count("static const struct affine_f32") == 3
    assert "m/s^2 from counts" in text
    (tmp_path / "calibration.h").write_text(text)
    (tmp_path / "t.c").write_text(
        '#include "calibration.h"\n#include "calibration.h"\n#include <stdio.h>\nint main(void) {\n'
        "for (int i = 0; i < 3; i++) { float y = 0.0f; for (int j = 0; j < 3; j++)\n"
        "y += gyro_calibration_f32.matrix[i][j] * ((float)(j + 5) - gyro_calibration_f32.offset[j]);\n"
        "y += 0.0f * (accel_calibration_f32.offset[0] + mag_calibration_f32.offset[0]);\n"
        'printf("%.9g\\n", (double)y); }\n'
        "return 0; }\n"
    )
    subprocess.run(
        [c_compiler, "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "t.c", "-o", "t"],
        cwd=tmp_path,
        check=True,
    )
    done = subprocess.run([tmp_path / "t"], capture_output=True, text=True, check=True)
    np.testing.assert_allclose(
        np.array(done.stdout.split(), float), imu.gyro.apply([5.0, 6.0, 7.0]), rtol=1e-5, atol=1e-5
    )


def test_c_header_refuses_what_a_float_cannot_hold(rng):
    with pytest.raises(DataError, match="float can hold"):
        c_header([AffineCalibration(np.eye(3) * 1e42, np.zeros(3))])
    with pytest.raises(DataError, match="one calibration a sensor"):
        c_header([some(rng), some(rng)])
    with pytest.raises(DataError, match="none"):
        c_header([])


def test_kalibr_yaml_reads_back_to_the_same_sensor_model(rng):
    imu = ImuCalibration(some(rng), some(rng, "gyro"))
    imu0 = yaml.safe_load(kalibr_yaml(imu, rate=100.0))["imu0"]
    assert imu0["update_rate"] == 100.0
    imu_R_body = np.array(imu0["T_i_b"])[:3, :3]
    np.testing.assert_allclose(imu_R_body @ imu_R_body.T, np.eye(3), atol=1e-12)
    quantity = rng.standard_normal(3)
    lower, offset = (np.array(imu0["accelerometers"][name]) for name in ("M", "offset"))
    assert np.triu(lower, 1) == pytest.approx(0.0)
    np.testing.assert_allclose(lower @ imu_R_body @ quantity + offset, imu.accel.raw(quantity), rtol=1e-10)
    lower, turn, offset = (np.array(imu0["gyroscopes"][name]) for name in ("M", "C_gyro_i", "offset"))
    assert np.triu(lower, 1) == pytest.approx(0.0)
    np.testing.assert_allclose(
        lower @ turn @ imu_R_body @ quantity + offset, imu.gyro.raw(quantity), rtol=1e-10
    )
    with pytest.raises(DataError, match="neither"):
        kalibr_yaml(ImuCalibration())
