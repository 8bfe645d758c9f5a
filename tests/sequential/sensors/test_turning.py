"""The scale of a gyro, told by the way in which it turns gravity: simulated motions, and BROAD."""

import numpy as np
import pytest

from sequential.noise import ImuNoise
from sequential.readers import read_imu
from sequential.readers.imu.guess import guess_accel, guess_gyro
from sequential.sensors import ImuErrors, simulate_imu, stationary, tumble
from sequential.sensors.turning import is_calm, right_factor, too_far, turning_errors

FACTORS = np.array([1.0, np.pi / 180, 180 / np.pi, -1.0, 0.5, 2.0])
ERRORS = ImuErrors(ImuNoise(1e-3, 1e-2, 0.0, 0.0), gyro_bias=(0.05, -0.03, 0.02))


def moved(rng, **motion):
    return simulate_imu(tumble(40.0, rng, rest=5.0, **motion), rng, errors=ERRORS).recording


@pytest.mark.parametrize("angle", [0.3, 1.0, 2.0])
@pytest.mark.parametrize("index", range(len(FACTORS)))
def test_the_factor_that_was_applied_is_found(rng, angle, index):
    imu = moved(rng, angle=angle)
    errors = turning_errors(imu.gyro / FACTORS[index], imu.t, imu.accel, FACTORS)
    assert right_factor(errors) == index
    assert errors[index] < 0.2


def test_a_body_at_rest_tells_nothing_but_what_cannot_be(rng):
    imu = simulate_imu(stationary(60.0), rng, errors=ERRORS).recording
    errors = turning_errors(imu.gyro, imu.t, imu.accel, np.array([1.0, 300.0]))
    assert right_factor(errors) is None
    assert not too_far(errors)
    assert too_far(errors, 1)  # so much noise would have turned it


def test_too_short_to_tell(rng):
    imu = moved(rng).slice(0.0, 2.0)
    assert turning_errors(imu.gyro, imu.t, imu.accel, FACTORS) is None
    assert right_factor(None) is None
    assert not too_far(None)


def test_calm_and_not(rng):
    imu = moved(rng, angle=1.0)
    assert is_calm(imu.accel, imu.rate)
    shaken = imu.accel + rng.normal(0.0, 3.0, size=imu.accel.shape)
    assert not is_calm(shaken, imu.rate)


@pytest.mark.parametrize("number", ["01", "05", "07", "11", "16", "21", "24", "27", "29", "34"])
def test_units_of_broad_are_told(data_dir, number):
    """Every trial, given in the four combinations of units: never sure and wrong, and wrong in none."""
    (path,) = (data_dir / "imu" / "broad").glob(f"{number}_*.npz")
    imu = read_imu(path)
    for accel_unit, g in (("g", 1 / 9.80665), ("m/s^2", 1.0)):
        scale, _ = guess_accel(imu.accel * g, imu.rate)
        assert scale.name == accel_unit
    for gyro_unit, k in (("rad/s", 1.0), ("deg/s", 180 / np.pi)):
        scale, _ = guess_gyro(imu.gyro * k, imu.t, imu.accel, None)
        assert scale.name == gyro_unit
