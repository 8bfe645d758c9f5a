"""Each part of a characterisation against what was put in, or against an independent computation."""

import numpy as np
import pytest
from scipy import signal, stats

from sequential.errors import DataError, ShapeError
from sequential.sensors import characterize, step_response
from sequential.sensors.characterize_noise import distribution_of, noise_of
from sequential.sensors.characterize_resolution import lsb_of, oversampling_of, resolution_of
from sequential.sensors.characterize_spectrum import spectrum_of
from sequential.sensors.characterize_step_models import bandwidth, first_order, second_order
from sequential.sensors.characterize_timing import timing_of

T = np.arange(6000) * 0.01


@pytest.mark.parametrize("lsb", [1.0, 4.0, 9.80665 / 16384, 0.3])
@pytest.mark.parametrize("sigma", [0.3, 1.0, 30.0])
@pytest.mark.parametrize("count", [200, 6000])
def test_the_step_of_a_sensor_is_found(lsb, sigma, count, rng):
    values = lsb * np.round(7.3 + sigma * rng.standard_normal(count))
    assert lsb_of(values) == pytest.approx(lsb, rel=1e-9)
    assert lsb_of(np.float32(values).astype(float)) == pytest.approx(lsb, rel=1e-3)


def test_a_step_printed_with_few_digits_is_found(rng):
    values = np.round(np.round(3.0 * rng.standard_normal(3000)) * 9.80665 / 16384, 4)
    assert lsb_of(values) == pytest.approx(9.80665 / 16384, rel=5e-3)


def test_numbers_on_no_grid_have_no_step(rng):
    assert lsb_of(rng.standard_normal(3000)) == 0.0
    assert sum(lsb_of(rng.standard_normal(20)) > 0.0 for _ in range(200)) == 0
    assert lsb_of(np.ones(50)) == 0.0


def test_effective_bits(rng):
    ramp = np.round(np.linspace(-30000, 30000, 6000))
    assert resolution_of(ramp, 12.0**-0.5).effective_bits == pytest.approx(16.0)
    noisy = resolution_of(np.round(8.0 * rng.standard_normal(6000)), 8.0)
    assert noisy.noise_bits == pytest.approx(np.log2(8.0 * 12.0**0.5))
    assert noisy.effective_bits == pytest.approx(16.0 - noisy.noise_bits)


def test_averaging_white_noise_gains_a_bit_for_every_factor_of_four(rng):
    found = oversampling_of(rng.standard_normal(40_000))
    np.testing.assert_array_equal(found.expected, np.arange(len(found.factor)))
    assert (np.abs(found.bits - found.expected) < 4.0 * np.hypot(found.error, found.error[0])).all()
    assert found.useful == found.factor[-1]


def test_averaging_does_not_help_against_a_walk(rng):
    found = oversampling_of(rng.standard_normal(40_000) + np.cumsum(0.05 * rng.standard_normal(40_000)))
    assert found.useful < 300
    assert found.bits[-1] < found.bits.max()


def test_rounding_without_noise_gains_nothing():
    assert oversampling_of(np.round(np.full(4000, 3.4))).bits.max() == 0.0


def test_welch_is_scipy_s(rng):
    x = rng.standard_normal(8000) + np.sin(0.7 * np.arange(8000))
    found = spectrum_of(x, 100.0)
    length = round(100.0 / (found.frequency[1] - found.frequency[0]))
    hz, density = signal.welch(x, 100.0, "hann", length, length - length // 2, detrend="constant")
    np.testing.assert_allclose(found.frequency, hz[1:])
    np.testing.assert_allclose(found.density, density[1:], rtol=1e-9)


def test_the_density_and_the_lines_of_a_spectrum(rng):
    x = 0.3 * rng.standard_normal(40_000)
    found = spectrum_of(x, 200.0)
    assert found.noise_density == pytest.approx(0.3 / 200.0**0.5, rel=0.02)
    assert not found.lines
    low, high = found.interval
    truth = 2 * 0.09 / 200.0
    inside = (found.density * low < truth) & (truth < found.density * high)
    assert 0.92 < inside.mean() < 0.98
    hum = x + 0.1 * np.sin(2 * np.pi * 50.0 * np.arange(40_000) / 200.0)
    (hz, sigma), *others = spectrum_of(hum, 200.0).lines
    assert hz == pytest.approx(50.0, abs=0.2)
    assert sigma == pytest.approx(0.1 / 2**0.5, rel=0.1)
    assert not others


def test_skewness_kurtosis_and_distance_are_scipy_s(rng):
    x = rng.standard_normal(3000)
    found = distribution_of(x, noise_of(x, parameters=1))
    assert found.skewness.value == pytest.approx(stats.skew(x))
    assert found.kurtosis.value == pytest.approx(stats.kurtosis(x))
    assert found.distance == pytest.approx(stats.kstest(x, "norm", (x.mean(), x.std())).statistic)
    assert found.p == pytest.approx(stats.jarque_bera(x).pvalue, rel=0.2)
    assert found.counts.sum() == 3000
    assert found.nearly_normal


@pytest.mark.parametrize("sigma", [0.6, 2.0, 20.0])
def test_rounding_is_not_taken_for_a_lack_of_normality(sigma, rng):
    found = characterize(T, np.round(sigma * rng.standard_normal(6000) + 2e-3 * sigma * T))
    assert found.distribution.distance < 0.02
    counts = found.distribution.counts
    assert counts.sum() == 6000
    assert not (counts[1:-1] == 0).any() or sigma > 10.0, "no false teeth"


def test_many_readings_make_a_small_p_of_a_small_distance(rng):
    x = rng.standard_normal(200_000)
    x += 0.02 * (x**2 - 1.0)
    found = distribution_of(x, noise_of(x))
    assert found.p < 1e-6
    assert found.nearly_normal, "sure not to be normal, and near enough"
    assert not distribution_of(rng.exponential(size=2000), noise_of(rng.exponential(size=2000))).nearly_normal


def test_outliers_are_counted_and_measured(rng):
    x = rng.standard_normal(6000)
    bad = rng.choice(6000, 12, replace=False)
    x[bad] += 40.0 * rng.choice([-1.0, 1.0], 12)
    found = characterize(T, x)
    assert set(np.flatnonzero(found.outliers.where)) == set(bad)
    assert found.outliers.typical == pytest.approx(40.0, rel=0.05)
    assert found.outliers.per_hour == pytest.approx(12 / 60.0 * 3600, rel=1e-3)
    assert found.noise.sigma.value == pytest.approx(1.0, rel=0.03), "and do not count as noise"


def test_white_noise_has_no_outliers(rng):
    assert characterize(np.arange(40_000) * 0.01, rng.standard_normal(40_000)).outliers.count == 0


def test_jitter_gaps_and_repeats():
    rng = np.random.default_rng(3)
    t = np.cumsum(10_000_000 + np.round(200_000 * rng.standard_normal(5000)).astype(np.int64))
    t[3000:] += 500_000_000
    found = timing_of(t)
    assert found.rate == pytest.approx(100.0, rel=1e-3)
    assert found.jitter == pytest.approx(2e-4, rel=0.05)
    assert len(found.gaps) == 1
    assert found.gaps[0] == pytest.approx([(t[2999] - t[0]) * 1e-9, 0.51], abs=1e-3)
    assert found.missing == 50
    assert not found.computed
    assert timing_of(np.arange(100) * 5_000_000).computed
    assert timing_of(np.repeat(np.arange(100), 2) * 5_000_000).repeated == 100


def test_temperature_is_told_apart_from_noise(rng):
    heat = 20.0 + 10.0 * T / T[-1] + 2.0 * np.sin(T / 3.0)
    found = characterize(T, 0.05 * heat + 0.1 * rng.standard_normal(6000), temperature=heat)
    assert found.per_degree.low < 0.05 < found.per_degree.high
    assert found.warmed == pytest.approx(12.0, abs=3.0)
    assert characterize(T, rng.standard_normal(6000), temperature=np.full(6000, 20.1)).per_degree is None


def test_the_same_in_another_unit(rng):
    x = np.round(5.0 * rng.standard_normal(3000)) + 0.01 * T[:3000]
    one, other = characterize(T[:3000], x), characterize(T[:3000], 1000.0 * x)
    for name in ("bias", "drift"):
        np.testing.assert_allclose(getattr(other, name), 1000.0 * np.array(getattr(one, name)), rtol=1e-6)
    np.testing.assert_allclose(other.noise.sigma, 1000.0 * np.array(one.noise.sigma), rtol=1e-9)
    assert other.distribution.distance == pytest.approx(one.distribution.distance)
    assert other.resolution.lsb == pytest.approx(1000.0 * one.resolution.lsb)


def test_a_stuck_sensor_is_said_to_be_stuck():
    found = characterize(T, np.full(6000, 3.25))
    assert found.stuck
    assert found.noise.sigma.value == 0.0
    assert found.bias.value == 3.25


def test_bad_input():
    with pytest.raises(DataError, match="50 at least"):
        characterize(np.arange(20), np.arange(20.0))
    with pytest.raises(ShapeError, match="one shape"):
        characterize(np.arange(20), np.zeros((20, 3)))
    with pytest.raises(ShapeError, match="temperature needs"):
        characterize(T, np.sin(T), temperature=[1.0])


def test_the_bandwidth_is_where_the_gain_has_fallen():
    for p, num, den in (
        ((0.0, 0.2), [1.0], [0.2, 1.0]),
        ((0.0, 0.05, 0.4), [1.0], [0.05**2, 2 * 0.4 * 0.05, 1.0]),
    ):
        turn = 2 * np.pi * bandwidth(np.array(p))
        _, gain = signal.freqs(num, den, [turn])
        assert abs(gain[0]) == pytest.approx(2.0**-0.5)


@pytest.mark.parametrize("zeta", [0.3, 1.0, 2.5])
def test_the_steps_are_scipy_s(zeta):
    t = np.linspace(0.0, 3.0, 301)
    expected = signal.step(([1.0], [0.1**2, 2 * zeta * 0.1, 1.0]), T=t)[1]
    np.testing.assert_allclose(second_order(t, np.array([0.0, 0.1, zeta])), expected, rtol=0, atol=1e-6)
    expected = signal.step(([1.0], [0.1, 1.0]), T=t)[1]
    np.testing.assert_allclose(first_order(t, np.array([0.0, 0.1])), expected, rtol=0, atol=1e-9)


def test_a_step_within_one_sample_is_not_resolved(rng):
    t = np.arange(300) * 0.01
    found = step_response(t, (t > 1.234) + 0.01 * rng.standard_normal(300), at=1.2)
    assert not found.resolved
    assert found.time_constant.low == 0.0
    assert found.latency.low < 0.034 < found.latency.high
    assert np.isinf(found.bandwidth.high)


def test_no_step_is_no_step(rng):
    with pytest.raises(DataError, match="no step stands out"):
        step_response(np.arange(300) * 0.01, rng.standard_normal(300))


def test_a_real_mpu6050(data_dir):
    raw = np.loadtxt(data_dir / "imu/mpu6050/example_data_tinit_calc.csv", delimiter=",", skiprows=5)
    expected = (0.00751, 0.01123, 0.00934)  # °/s/√Hz, by an Allan deviation
    for k, density in zip((3, 4, 5), expected, strict=True):
        found = characterize(np.arange(len(raw)) * 10_000_000, raw[:, k])
        assert found.resolution.lsb == 1.0
        assert found.spectrum.noise_density / 131.0 == pytest.approx(density, rel=0.03)
        assert found.distribution.nearly_normal
    accelerometer = characterize(np.arange(len(raw)) * 10_000_000, raw[:, 0])
    assert accelerometer.resolution.lsb == 4.0, "its two last bits never change"
    np.testing.assert_allclose(accelerometer.oversampling.bits[:4], [0, 1, 2, 3], atol=0.1)


def test_another_real_recording_of_the_same_sensor(data_dir):
    """A hundred seconds instead of seven and a half minutes: the same noise, a bias that has moved."""
    long, short = (
        np.loadtxt(data_dir / f"imu/mpu6050/{name}.csv", delimiter=",", skiprows=5)
        for name in ("example_data_tinit_calc", "imu_static_test")
    )
    for k in range(3, 6):
        one, other = (characterize(np.arange(len(x)) * 10_000_000, x[:, k]) for x in (long, short))
        assert other.noise.sigma.value == pytest.approx(one.noise.sigma.value, rel=0.03)
        assert np.diff(other.noise.sigma[1:]) > 1.5 * np.diff(one.noise.sigma[1:]), "less is known from less"
        assert other.noise.white
        assert other.timing.computed
