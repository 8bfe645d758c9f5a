import numpy as np
import pytest
from field_worlds import CENTRE, ROOT, points, recording, smooth_turns, sphere

from sequential.errors import DataError, MissingStreamError, UnderConstrainedError
from sequential.readers import read_broad, read_imu
from sequential.sensors import ImuRecording, MagnetometerEllipsoid
from sequential.sensors.field_readings import difference_noise


def test_truth_is_found_from_a_recording(rng):
    raw = points(0, rng, directions=smooth_turns(6000, rng))
    fit = MagnetometerEllipsoid(field=46.0).calibrate(recording(raw))
    np.testing.assert_allclose(fit.calibration.matrix, 46.0 * ROOT, atol=0.01)
    np.testing.assert_allclose(fit.calibration.offset, CENTRE, atol=0.2)
    np.testing.assert_allclose(np.linalg.norm(fit.calibration.apply(raw), axis=1).mean(), 46.0, rtol=2e-3)
    assert fit.calibration.unit_out == "uT"
    assert fit.check.raw.spread > 0.2
    assert fit.check.calibrated.spread < 0.004
    assert not fit.planar
    np.testing.assert_allclose(fit.radii, 1 / np.linalg.eigvalsh(ROOT)[::-1], rtol=0.01)
    truth = np.r_[46.0 * ROOT.ravel(), CENTRE]
    error = np.r_[fit.calibration.matrix.ravel(), fit.calibration.offset] - truth
    assert (np.abs(error) < 4.5 * np.sqrt(np.diag(fit.calibration.cov))).all()


def test_without_a_field_the_mean_gain_is_one(rng):
    raw = points(0, rng, directions=smooth_turns(4000, rng))
    fit = MagnetometerEllipsoid().calibrate(recording(100 * raw, "counts"))
    np.testing.assert_allclose(np.linalg.det(fit.calibration.matrix), 1.0)
    assert fit.calibration.unit_in == fit.calibration.unit_out == "counts"


def test_verification_uses_other_readings(rng):
    a, b = (recording(points(0, rng, directions=smooth_turns(5000, rng)[lag:])) for lag in (0, 700))
    fit = MagnetometerEllipsoid().calibrate(a)
    assert fit.verify(b).calibrated.spread < 0.006
    shifted = recording(b.mag + np.array([6.0, 0.0, 0.0]))
    assert fit.verify(shifted).calibrated.spread > 0.05
    with pytest.raises(DataError, match="takes uT"):
        fit.verify(recording(b.mag, "counts"))


def test_noise_is_found_from_differences(rng):
    raw = points(0, rng, directions=smooth_turns(6000, rng), sigma=0.7)
    np.testing.assert_allclose(difference_noise(raw), 0.7, rtol=0.06)


def test_noise_that_outliers_overrate_is_set_right(rng):
    """A tenth of the readings are wild: a third of all differences is, and the median with them."""
    raw = points(0, rng, directions=smooth_turns(3000, rng), sigma=0.1)
    hit = rng.random(len(raw)) < 0.15
    raw[hit] += 25 * rng.standard_normal((hit.sum(), 3))
    assert difference_noise(raw).max() > 0.2
    fit = MagnetometerEllipsoid().calibrate(recording(raw))
    np.testing.assert_allclose(np.sqrt(np.diag(fit.readings.noise_cov)), 0.1, rtol=0.35)
    np.testing.assert_allclose(fit.calibration.offset, CENTRE, atol=0.05)


def test_a_sensor_without_noise_is_calibrated_exactly(rng):
    raw = points(0, rng, directions=smooth_turns(2000, rng), sigma=0.0)
    fit = MagnetometerEllipsoid(field=1.0).calibrate(recording(raw))
    np.testing.assert_allclose(fit.calibration.matrix, ROOT, atol=2e-6)


def test_a_planar_turn_is_calibrated_in_its_plane_and_says_so(rng):
    raw = points(0, rng, directions=smooth_turns(3000, rng, planar=True), sigma=0.3)
    fit = MagnetometerEllipsoid().calibrate(recording(raw))
    assert fit.planar
    assert abs(fit.normal @ np.linalg.inv(ROOT)[:, :2]).max() < 0.05 * 46
    assert fit.check.calibrated.mean[np.isfinite(fit.check.calibrated.mean)].std() < 0.01
    assert any("planar turn" in f.what and "not observed" in f.what for f in fit.findings)
    assert fit.calibration.sigmas()[1].max() > 20  # the offset along the normal is unknown


@pytest.mark.parametrize(
    ("directions", "axis"), [(lambda d: d[d[:, 2] > 0.7], "z"), (lambda d: d[d[:, 0] < -0.7], "x")]
)
def test_too_few_directions_are_named(rng, directions, axis):
    raw = points(0, rng, directions=directions(sphere(8000, rng)), sigma=3.0, root=np.eye(3) / 46)
    with pytest.raises(UnderConstrainedError, match=rf"{axis} axis: they cover too few"):
        MagnetometerEllipsoid(noise=3.0).calibrate(recording(raw))


def test_hard_iron_alone_is_found_from_few_directions(rng):
    cap = sphere(4000, rng)
    cap = cap[(cap[:, 2] > 0.2) & (cap[:, 0] > -0.5)]
    raw = points(0, rng, directions=cap, sigma=0.3, root=np.eye(3) / 46)
    fit = MagnetometerEllipsoid(sphere=True, noise=0.3).calibrate(recording(raw))
    np.testing.assert_allclose(fit.calibration.matrix, np.eye(3), atol=1e-9)
    error = fit.calibration.offset - CENTRE
    assert np.abs(error).max() < 0.5
    assert (np.abs(error) < 4.5 * fit.calibration.sigmas()[1]).all()
    assert any("hard iron alone" in f.what for f in fit.findings)


def test_half_a_planar_turn_is_too_little(rng):
    half = smooth_turns(3000, rng, planar=True)
    raw = points(0, rng, directions=half[half[:, 1] > 0.2])
    with pytest.raises(UnderConstrainedError, match="too few"):
        MagnetometerEllipsoid().calibrate(recording(raw))


@pytest.mark.parametrize(
    ("mag", "sentence"),
    [
        (np.full((500, 3), 20.0), "axis x, y, z is constant"),
        (np.column_stack([np.arange(500.0), np.arange(500.0) ** 2, np.ones(500)]), "axis z is constant"),
        (np.full((500, 3), np.nan), "constant"),
        (np.random.default_rng(0).standard_normal((30, 3)), "50 at least"),
    ],
)
def test_bad_readings_are_told(mag, sentence):
    with pytest.raises(DataError, match=sentence):
        MagnetometerEllipsoid().calibrate(recording(mag))


def test_saturated_readings_are_left_out_or_refused(rng):
    raw = points(0, rng, directions=smooth_turns(6000, rng), sigma=0.2)
    limit = np.quantile(raw[:, 0], 0.97)
    clipped = raw.copy()
    clipped[:, 0] = np.minimum(clipped[:, 0], limit)
    fit = MagnetometerEllipsoid().calibrate(recording(clipped))
    whole = MagnetometerEllipsoid().calibrate(recording(raw))
    np.testing.assert_allclose(fit.calibration.offset, whole.calibration.offset, atol=0.1)
    assert any("saturated" in f.what for f in fit.findings)
    hopeless = np.clip(raw, CENTRE - 20, CENTRE + 20)
    with pytest.raises(DataError, match="saturated"):
        MagnetometerEllipsoid().calibrate(recording(hopeless))


def test_a_magnetometer_is_needed():
    still = ImuRecording(np.arange(9) * 0.01, accel=np.ones((9, 3)))
    with pytest.raises(MissingStreamError, match="no mag"):
        MagnetometerEllipsoid().calibrate(still)


@pytest.mark.parametrize("name", ["field", "noise"])
def test_settings_are_checked(name):
    with pytest.raises(DataError, match=name):
        MagnetometerEllipsoid(**{name: -1.0})


def test_repeated_and_missing_rows_are_no_readings(rng):
    raw = points(0, rng, directions=smooth_turns(4000, rng))
    held = np.repeat(raw, 2, axis=0)
    sparse = np.full((2 * len(raw), 3), np.nan)
    sparse[::2] = raw
    a, b, c = (MagnetometerEllipsoid().calibrate(recording(m)) for m in (raw, held, sparse))
    np.testing.assert_allclose(b.calibration.matrix, a.calibration.matrix, rtol=1e-12)
    np.testing.assert_allclose(c.calibration.matrix, a.calibration.matrix, rtol=1e-12)


# --- recordings ---


def test_qmc5883l_norm_is_even_to_one_percent(data_dir):
    imu = read_imu(data_dir / "imu" / "qmc5883l" / "noisy_raw_data.csv")
    fit = MagnetometerEllipsoid().calibrate(imu)
    assert fit.check.calibrated.covered == 24
    assert fit.check.calibrated.spread < 0.01
    assert fit.check.raw.spread > 0.08
    np.testing.assert_allclose(fit.fit.sigma, fit.fit.expected, rtol=0.05)  # nothing but the sensor's noise
    np.testing.assert_allclose(np.sqrt(np.diag(fit.readings.noise_cov)), [56, 55, 59], atol=2)


def test_broad_beside_a_magnet(data_dir):
    """A magnet stands in the room: readings near it are left out, the others stay as even as without it."""
    folder = data_dir / "imu" / "broad"
    found = {}
    for path in sorted(folder.glob("*.npz")):
        if "stationary_magnet" in path.name or "undisturbed_slow_rotation_with" in path.name:
            imu, _ = read_broad(path)
            found["magnet" in path.name] = MagnetometerEllipsoid().calibrate(imu)
    assert found[True].outliers.mean() > 0.01
    assert found[True].fit.sigma < 0.03
    np.testing.assert_allclose(found[True].field, found[False].field, rtol=0.03)
    assert not found[False].outliers.mean() > 0.01
