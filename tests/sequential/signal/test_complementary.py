"""Two signals that complement each other."""

import numpy as np
import pytest

from sequential.log import Stream
from sequential.manifold.so2 import wrap_angle
from sequential.signal import (
    Complementary,
    Hampel,
    LowPass,
    SlidingMedian,
    measure_noise_gain,
    measure_step_delay,
)

T = np.arange(2000) * 0.01


def test_the_textbook_recursion(rng):
    slow, fast = rng.standard_normal((2, 300))
    a = 1 - np.exp(-0.01 / 0.5)
    y, path = slow[0], [slow[0]]
    for k in range(1, 300):
        y = (1 - a) * (y + fast[k] - fast[k - 1]) + a * slow[k]
        path.append(y)
    np.testing.assert_allclose(Complementary(0.5)(T[:300], slow, fast=fast), path, rtol=0, atol=1e-13)


def test_it_is_a_low_pass_and_what_the_same_low_pass_leaves(rng):
    slow, fast = rng.standard_normal((2, 300))
    low = LowPass(0.5)
    t = np.cumsum(rng.exponential(0.05, 300))
    expected = low(t, slow) + fast - low(t, fast)
    np.testing.assert_allclose(Complementary(0.5)(t, slow, fast=fast), expected, rtol=0, atol=1e-12)


def test_a_motion_that_both_see_passes_unchanged():
    motion = np.sin(3.0 * T) + 0.2 * T
    y = Complementary(0.5)(T, motion, rate=3.0 * np.cos(3.0 * T) + 0.2)
    np.testing.assert_allclose(y, motion, rtol=0, atol=2e-4)


def test_a_bias_of_the_rate_stays_bounded():
    """Integrated alone it would reach 0.4 rad; blended, it leaves b·τ."""
    blend = Complementary(0.5)
    y = blend(T, np.zeros(2000), rate=np.full(2000, 0.02))
    assert y[-1] == pytest.approx(float(blend.bias_error(0.02, 0.01)), rel=1e-9)
    assert y[-1] == pytest.approx(0.02 * 0.5, rel=0.02)


def test_what_it_says_of_itself(rng):
    blend, still = Complementary(0.2), np.zeros
    stated = blend.response(0.01)
    slow_alone = lambda t, x: blend(t, x, rate=still(len(t)))  # noqa: E731
    assert measure_step_delay(slow_alone, 0.01) == pytest.approx(stated.delay_90)
    assert measure_noise_gain(slow_alone, rng, 0.01) == pytest.approx(stated.noise_gain, rel=0.04)
    rate_alone = lambda t, x: blend(t, still(len(t)), rate=x)  # noqa: E731
    assert measure_noise_gain(rate_alone, rng, 0.01) == pytest.approx(blend.rate_noise_gain(0.01), rel=0.04)


def test_angles_take_the_short_way_round(rng):
    """A heading that turns through the cut, by compass and gyro, against the same without a cut."""
    heading = 2.5 * T + 0.3 * np.sin(T)
    rate = 2.5 + 0.3 * np.cos(T)
    compass = heading + 0.05 * rng.standard_normal(2000)
    free = Complementary(1.0)(T, compass, rate=rate)
    wrapped = Complementary(1.0, angle=True)(T, wrap_angle(compass), rate=rate)
    np.testing.assert_allclose(wrap_angle(wrapped - free), 0.0, rtol=0, atol=1e-9)
    assert np.abs(wrapped).max() <= np.pi
    naive = Complementary(1.0)(T, wrap_angle(compass), rate=rate)
    assert np.max(np.abs(wrap_angle(naive - heading))) > 1.0  # what happens without


@pytest.mark.parametrize("angle", [False, True])
def test_sample_by_sample_gives_what_the_whole_signal_gives(angle, rng):
    t = np.cumsum(rng.exponential(0.02, 400))
    slow, rate = 3.0 + 0.3 * rng.standard_normal(400), rng.standard_normal(400)
    slow = wrap_angle(slow) if angle else slow
    slow[rng.random(400) < 0.6] = np.nan  # a slow sensor that reads less often
    blend = Complementary(0.3, angle=angle)
    state, path = blend.start(), []
    for row in zip(t.tolist(), slow.tolist(), rate.tolist(), strict=True):
        y, state = blend.step(state, *row)
        path.append(y)
    whole = blend(t, slow, rate=rate)
    known = np.flatnonzero(~np.isnan(slow))[0]
    assert np.isnan(whole[:known]).all()
    assert np.isnan(path[:known]).all()
    off = np.array(path[known:]) - whole[known:]
    np.testing.assert_allclose(wrap_angle(off) if angle else off, 0.0, rtol=0, atol=1e-12)


def test_streams_of_the_same_stamps(rng):
    slow, rate = rng.standard_normal((2, 100, 3))
    blended = Complementary(0.3)(Stream(T[:100], slow), rate=Stream(T[:100], rate))
    np.testing.assert_allclose(blended.values, Complementary(0.3)(T[:100], slow, rate=rate), atol=1e-12)


def test_an_imu_turned_by_ninety_degrees(data_dir):
    """A real MPU-6050: what is quick comes from the gyro, what stays from the accelerometer."""
    raw = np.loadtxt(data_dir / "imu/mpu6050/imu_90_x_rot.csv", delimiter=",", skiprows=5)
    t = np.arange(len(raw)) * 0.01
    still = slice(0, 1000)
    gyro = np.radians((raw[:, 3] - raw[still, 3].mean()) / 131.0)
    roll = np.degrees(np.arctan2(raw[:, 1], raw[:, 2]))
    turned = np.degrees(np.sum(gyro[:3000]) * 0.01)
    assert turned == pytest.approx(90.0, abs=3.0)
    blend = np.degrees(Complementary(5.0, angle=True)(t, np.radians(roll), rate=gyro))
    quick = slice(1000, 3000)
    assert np.ptp(np.diff(blend[quick]) - np.degrees(gyro[1001:3000]) * 0.01) < 0.5
    # the raw accelerometer is not calibrated, and 8 degrees off lying on its side; in the long run it decides
    assert np.mean(blend[-1000:]) == pytest.approx(np.mean(roll[-1000:]), abs=0.2)
    assert np.std(np.diff(blend[still])) < 0.2 * np.std(np.diff(roll[still]))


def test_median_and_hampel_on_a_real_accelerometer(data_dir):
    """Still for 100 s: removing what Hampel calls outliers hardly changes the spread of a good sensor."""
    raw = np.loadtxt(data_dir / "imu/mpu6050/imu_static_test.csv", delimiter=",", skiprows=5)[:, :3]
    outliers = Hampel(31, centred=True, threshold=4.0, floor=1.0).outliers(raw)
    assert outliers.mean() < 0.01
    white = np.std(np.diff(raw, axis=0), axis=0) / np.sqrt(2.0)
    left = np.std(np.diff(SlidingMedian(9)(raw), axis=0), axis=0) / np.sqrt(2.0)
    assert (left < 0.5 * white).all()
