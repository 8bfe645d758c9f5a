import numpy as np
import pytest

from sequential.errors import DataError, MissingStreamError, UnderConstrainedError
from sequential.readers import read_broad, read_imu
from sequential.sensors import ImuRecording, MagnetometerEllipsoid
from sequential.sensors.ellipsoid_fit import (
    _derivative,
    _moved,
    excess,
    fit_ellipsoid,
    parameters_of,
)
from sequential.sensors.ellipsoid_moments import ellipsoid_from_moments, symmetric_root
from sequential.sensors.field_readings import difference_noise

ROOT = np.array([[1 / 50, -4e-4, 0.0], [-4e-4, 1 / 42, 5e-4], [0.0, 5e-4, 1 / 46]])  # 1/µT
CENTRE = np.array([12.0, -30.0, 5.0])


def sphere(count, rng):
    d = rng.standard_normal((count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def points(count, rng, *, sigma=0.5, directions=None, root=ROOT):
    unit = sphere(count, rng) if directions is None else directions
    return unit @ np.linalg.inv(root) + CENTRE + sigma * rng.standard_normal((len(unit), 3))


def smooth_turns(count, rng, *, planar=False):
    """Directions of a sensor that turns smoothly, as a recording has them."""
    t = np.arange(count) * 0.02
    if planar:
        return np.stack([np.cos(1.3 * t), np.sin(1.3 * t), np.zeros(count)], axis=1)
    z = np.sin(0.11 * t + 0.3 * np.sin(0.02 * t))
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(1.7 * t), r * np.sin(1.7 * t), z], axis=1)


def recording(mag, unit="uT"):
    return ImuRecording(np.arange(len(mag)) * 0.02, mag=mag, mag_unit=unit, name="turns")


# --- the parts ---


def test_excess_is_what_noise_adds_to_a_norm(rng):
    noise = np.diag([0.1, 0.05, 0.08]) ** 2
    vector = np.array([[0.6, 0.0, 0.8]])
    noisy = vector + rng.standard_normal((400_000, 3)) @ symmetric_root(noise)
    norms = np.linalg.norm(noisy, axis=1)
    mean, variance = excess(vector, noise)
    np.testing.assert_allclose(norms.mean() - 1, mean[0], rtol=0.1)
    np.testing.assert_allclose(norms.var(), variance[0], rtol=0.03)


def test_derivative_meets_central_differences(rng):
    arm = points(20, rng) - CENTRE
    given = _derivative(arm, ROOT)
    for k in range(9):
        step = np.zeros(9)
        step[k] = 1e-7 if k < 6 else 1e-4
        ends = []
        for sign in (1, -1):
            root, centre = _moved(ROOT, np.zeros(3), sign * step)
            ends.append(np.linalg.norm((arm - centre) @ root, axis=1))
        np.testing.assert_allclose((ends[0] - ends[1]) / (2 * step[k]), given[:, k], rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_exact_points_give_the_exact_ellipsoid(rng, dim):
    root, centre = ROOT[:dim, :dim], CENTRE[:dim]
    unit = rng.standard_normal((60, dim))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    exact = unit @ np.linalg.inv(root) + centre
    found = ellipsoid_from_moments(exact, np.zeros((dim, dim)))
    np.testing.assert_allclose(found[0], root, atol=1e-10)
    np.testing.assert_allclose(found[1], centre, atol=1e-7)
    fit = fit_ellipsoid(exact + 1e-6 * rng.standard_normal(exact.shape), 1e-12 * np.eye(dim), rng)
    np.testing.assert_allclose(fit.root, root, atol=1e-7)


def test_moments_and_the_constraint_of_li_and_griffiths_give_an_ellipsoid_of_a_thin_cap(rng):
    """Where noise makes the free quadric a hyperboloid, an ellipsoid comes back or nothing does."""
    directions = sphere(4000, rng)
    cap = directions[directions[:, 2] > 0.8]
    kinds = set()
    for _ in range(20):
        found = ellipsoid_from_moments(points(0, rng, directions=cap, sigma=6.0), 36.0 * np.eye(3))
        kinds.add(found is None)
        if found is not None:
            assert (np.linalg.eigvalsh(found[0]) > 0).all()
    assert False in kinds


# --- consistency: noise must not shrink or swell the ellipsoid ---


@pytest.mark.parametrize("even", [True, False])
def test_noise_leaves_no_bias_where_plain_least_squares_has_one(rng, even):
    sigma = 0.07 * 46  # 7 % of the field a reading
    directions = sphere(120_000, rng)
    if not even:
        directions = directions[directions[:, 0] > -0.3]
    noisy = points(0, rng, sigma=sigma, directions=directions)
    gain = np.linalg.eigvalsh(ROOT)
    plain = np.linalg.eigvalsh(ellipsoid_from_moments(noisy, np.zeros((3, 3)))[0])
    consistent = np.linalg.eigvalsh(ellipsoid_from_moments(noisy, sigma**2 * np.eye(3))[0])
    refined = np.linalg.eigvalsh(fit_ellipsoid(noisy, sigma**2 * np.eye(3), rng).root)
    assert np.abs(plain / gain - 1).max() > 0.008
    assert np.abs(consistent / gain - 1).max() < 0.006
    assert np.abs(refined / gain - 1).max() < 0.004


def test_covariance_is_that_of_many_recordings(rng):
    truth = parameters_of(ROOT, CENTRE)
    nees, inside = [], []
    for _ in range(80):
        fit = fit_ellipsoid(points(800, rng, sigma=1.0), np.eye(3), rng)
        error = parameters_of(fit.root, fit.centre) - truth
        nees.append(error @ np.linalg.solve(fit.cov, error))
        inside.append(np.abs(error) < 1.96 * np.sqrt(np.diag(fit.cov)))
    assert 7.5 < np.mean(nees) < 11.5  # nine parameters
    assert 0.91 < np.mean(inside) < 0.98


def test_covariance_counts_neighbours_that_err_together(rng):
    """The same points, each five times in a row, know no more than once."""
    once = points(2000, rng, sigma=1.0)
    many = np.repeat(once, 5, axis=0)
    a, b = (fit_ellipsoid(p, np.eye(3), rng) for p in (once, many))
    np.testing.assert_allclose(np.diag(b.cov), np.diag(a.cov), rtol=0.5)


def test_covariance_counts_a_field_that_wanders(rng):
    """Hard iron that drifts by 1 % of the field over minutes: intervals grow, and still cover the mean."""
    t = np.linspace(0, 1, 8000)
    still = points(0, rng, directions=smooth_turns(len(t), rng), sigma=0.5)
    wander = 0.6 * np.stack([np.sin(9 * t), np.cos(7 * t + 1), np.sin(8 * t + 2)], axis=1)
    a, b = (fit_ellipsoid(p, 0.25 * np.eye(3), rng) for p in (still, still + wander))
    assert (np.diag(b.cov)[6:] > 2 * np.diag(a.cov)[6:]).all()
    off = b.centre - (CENTRE + wander.mean(axis=0))
    assert (np.abs(off) < 4 * np.sqrt(np.diag(b.cov)[6:])).all()


@pytest.mark.parametrize("share", [0.05, 0.2, 0.3])
def test_outliers_have_no_say(rng, share):
    clean = points(3000, rng, sigma=0.5)
    spoilt = clean.copy()
    hit = rng.random(len(clean)) < share
    spoilt[hit] += np.array([25.0, 10.0, -15.0]) + 5 * rng.standard_normal((hit.sum(), 3))
    a, b = (fit_ellipsoid(p, 0.25 * np.eye(3), rng) for p in (clean, spoilt))
    np.testing.assert_allclose(b.root, a.root, atol=4e-4)
    np.testing.assert_allclose(b.centre, a.centre, atol=0.4)
    assert (b.weights[hit] == 0).mean() > 0.6


# --- the whole ---


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
