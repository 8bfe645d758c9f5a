"""Calibration as parts of the state: odometry scales, range scale and offset, where a sensor sits."""

import numpy as np
import pytest

from sequential import SE2, Gaussian, Product, Range, RangeBearing, StateSpace, Unicycle, Vector
from sequential.errors import ModelError
from sequential.jacobians import check_jacobians
from sequential.model import evaluate

STATE = Product(
    pose=SE2(), odometry=Vector(2), camera=SE2(), scale=Vector(1), offsets=Vector(3), scales=Vector(3)
)
LANDMARKS = np.array([[4.0, 1.0], [-3.0, 2.0], [0.5, -5.0]])
SENSORS = {
    "plain": Range(LANDMARKS, 1.0),
    "one of each": Range(LANDMARKS, 1.0, bias="scale", scale="scale"),
    "for each landmark": Range(LANDMARKS, 1.0, bias="offsets", scale="scales"),
    "bearing": RangeBearing(LANDMARKS, [1.0, 1.0]),
    "bearing, scaled": RangeBearing(LANDMARKS, [1.0, 1.0], scale="scale"),
    "bearing, mounted": RangeBearing(LANDMARKS, [1.0, 1.0], mount="camera"),
    "bearing, both": RangeBearing(LANDMARKS, [1.0, 1.0], scale="scale", mount="camera"),
}


def _model(x, sensors=None, process=None):
    process = Unicycle(0.1, 0.1, 0.1, scale="odometry") if process is None else process
    prior = Gaussian(x, np.eye(STATE.dim))
    return StateSpace(STATE, prior, process, {} if sensors is None else sensors, "odometry", check=False)


def _observe(name, x, k):
    f, size = SENSORS[name].functions(STATE), SENSORS[name].manifold.size
    return evaluate(f.value, x, np.array([float(k)]), 0.0, f.params, size)


@pytest.mark.parametrize("name", [name for name in SENSORS if name != "one of each"])
@pytest.mark.parametrize("dt", [1e-4, 0.01, 1.0, 3.0])
def test_jacobians_meet_differences(name, dt, rng):
    for seed in range(10):
        x = STATE.retract(STATE.identity(), 0.5 * rng.standard_normal(STATE.dim))
        check_jacobians(_model(x, {name: SENSORS[name]}), dt, seed)


@pytest.mark.parametrize("k", range(3))
def test_scale_then_offset(k, rng):
    x = STATE.random(rng)
    parts = STATE.unpack(x)
    distance = _observe("plain", x, k)
    expected = distance * (1 + parts["scales"][k]) + parts["offsets"][k]
    np.testing.assert_allclose(_observe("for each landmark", x, k), expected)


@pytest.mark.parametrize("k", range(3))
def test_a_mounted_sensor_sees_what_a_body_in_its_place_would(k, rng):
    x = STATE.random(rng)
    parts = STATE.unpack(x)
    c, s = np.cos(parts["pose"][2]), np.sin(parts["pose"][2])
    camera = parts["camera"]
    place = parts["pose"][:2] + np.array([[c, -s], [s, c]]) @ camera[:2]
    there = {**parts, "pose": [*place, parts["pose"][2] + camera[2]]}
    np.testing.assert_allclose(
        _observe("bearing, mounted", x, k), _observe("bearing", STATE.pack(**there), k)
    )


def test_odometry_scale_is_a_scale_of_the_input(rng):
    x = STATE.random(rng)
    u, dt = np.array([1.3, -0.4]), 0.7
    scaled, plain = (Unicycle(0.1, 0.1, 0.1, scale=name).functions(STATE) for name in ("odometry", None))
    share = 1 + STATE.unpack(x)["odometry"]
    expected = evaluate(plain.value, x, share * u, dt, plain.params, STATE.size)
    np.testing.assert_allclose(evaluate(scaled.value, x, u, dt, scaled.params, STATE.size), expected)


@pytest.mark.parametrize("turn", [0.0, 1e-9, 0.9999e-3, 1.0001e-3, 0.1, 3.0])
def test_series_and_closed_forms_agree(turn):
    """An arc cut in two ends where the whole one ends, on either side of the switch."""
    f = Unicycle(0.1, 0.1, 0.1).functions(SE2())
    x = np.zeros(3)
    whole = evaluate(f.value, x, np.array([2.0, turn]), 1.0, f.params, 3)
    half = evaluate(f.value, x, np.array([2.0, turn]), 0.5, f.params, 3)
    cut = evaluate(f.value, half, np.array([2.0, turn]), 0.5, f.params, 3)
    np.testing.assert_allclose(cut, whole, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("sensor", "message"),
    [
        (Range(LANDMARKS, 1.0, scale="odometry"), "Range's scale 'odometry' has 2 numbers"),
        (RangeBearing(LANDMARKS, 1.0, scale="scales"), "RangeBearing's scale 'scales' has 3 numbers"),
        (RangeBearing(LANDMARKS, 1.0, mount="pose"), "is the vehicle's pose"),
        (RangeBearing(LANDMARKS, 1.0, mount="scale"), "RangeBearing's mount needs a part 'scale'"),
    ],
)
def test_a_part_that_does_not_fit_is_named(sensor, message):
    with pytest.raises(ModelError, match=message):
        sensor.functions(STATE)


def test_unicycle_wants_two_scales():
    with pytest.raises(ModelError, match="has 1 numbers; 2, for speed and turn rate"):
        Unicycle(0.1, 0.1, 0.1, scale="scale").functions(STATE)
