"""The Allan family: equal to allantools, exact on sequences worked out by hand, and lawful."""

import warnings

import allantools
import numpy as np
import pytest
from allantools import ci

from sequential.errors import DataError, NotFiniteError, ShapeError
from sequential.sensors import allan_deviation
from sequential.sensors.allan_freedom import degrees_of_freedom

KINDS = ("overlapping", "hadamard", "modified", "plain")
ORACLE = {
    "overlapping": allantools.oadev,
    "hadamard": allantools.ohdev,
    "modified": allantools.mdev,
    "plain": allantools.adev,
}
RATE = 50.0


def white(rng, count):
    return 3.0 + rng.standard_normal(count)


def random_walk(rng, count):
    return np.cumsum(rng.standard_normal(count))


def all_sorts(rng, count):
    steps = rng.standard_normal((2, count))
    return steps[0] + 0.03 * np.cumsum(steps[1]) + 1e-3 * np.arange(count)


@pytest.mark.parametrize("signal", [white, random_walk, all_sorts])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [9, 1000, 20_011])
def test_deviations_are_those_of_allantools(kind, signal, count, rng):
    x = signal(rng, count)
    ours = allan_deviation(x, RATE, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        tau, deviation, _, n = ORACLE[kind](x, rate=RATE, data_type="freq", taus=ours.tau)
    assert (ours.n[ours.n > 1] == n).all()
    assert np.allclose(ours.tau[ours.n > 1], tau, rtol=1e-14)
    assert np.allclose(ours.deviation[ours.n > 1], deviation, rtol=1e-9, atol=0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_a_large_mean_costs_no_digits(kind, rng):
    x = rng.standard_normal(5000)
    there = allan_deviation(x + 2.0**20, RATE, kind).deviation
    assert np.allclose(there, allan_deviation(x, RATE, kind).deviation, rtol=1e-9)


def test_definition_on_a_short_record():
    # means over two samples: 1, 3, 1, 3 in four overlapping places each, differences by hand
    x = np.array([0.0, 2.0, 2.0, 4.0, 0.0, 2.0, 2.0, 4.0])
    means = (x[1:] + x[:-1]) / 2
    steps = means[2:] - means[:-2]
    found = allan_deviation(x, 1.0, taus=[2.0])
    assert found.n.tolist() == [5]
    assert found.deviation[0] == pytest.approx(np.sqrt(np.mean(steps**2) / 2), rel=1e-14)


GRID = [
    (alpha, order, m, count)
    for alpha in (2, 1, 0, -1, -2, -3, -4)
    for order in (2, 3)
    if alpha + 2 * order > 1
    for m in (1, 3, 20, 33, 34, 500, 3000)
    for count in (20, 101, 1001, 12_000, 100_001)
    if (order + 1) * m + 1 < count
]


@pytest.mark.parametrize(("overlapping", "modified"), [(False, False), (True, False), (True, True)])
def test_degrees_of_freedom_are_greenhall_s(overlapping, modified):
    compared = 0
    for alpha, order, m, count in GRID:
        if modified and order == 3:
            continue
        try:
            reference = ci.edf_greenhall(alpha, order, m, count, overlapping=overlapping, modified=modified)
        except (NotImplementedError, AssertionError):  # cases that allantools leaves open
            continue
        ours = degrees_of_freedom(alpha, order, m, count, overlapping=overlapping, modified=modified)
        assert ours == pytest.approx(reference, rel=1e-9), (alpha, order, m, count)
        compared += 1
    assert compared > 50


@pytest.mark.parametrize("kind", KINDS)
def test_intervals_are_those_of_allantools(kind, rng):
    x = all_sorts(rng, 4000)
    ours = allan_deviation(x, RATE, kind, taus=[0.02, 0.2, 0.4, 0.6])
    phase = allantools.frequency2phase(x, RATE)
    name = {"overlapping": "oadev", "hadamard": "ohdev", "modified": "mdev", "plain": "adev"}[kind]
    for row, tau in enumerate(ours.tau):
        low, high = ci.confidence_interval_noiseID(
            phase, ours.deviation[row], round(tau * RATE), dev_type=name, ci=0.95
        )
        assert (ours.low[row], ours.high[row]) == pytest.approx((low, high), rel=1e-9)


@pytest.mark.parametrize(("signal", "alpha"), [(white, 0), (random_walk, -2)])
def test_the_colour_is_recognised(signal, alpha, rng):
    found = allan_deviation(np.stack([signal(rng, 30_000) for _ in range(4)], axis=1), RATE)
    assert np.mean(found.alpha == alpha) > 0.95


@pytest.mark.parametrize("kind", KINDS)
def test_intervals_hold_the_truth(kind, seeds):
    tau = np.array([0.1, 1.0, 10.0])
    m = tau * RATE
    # white samples of unit variance; SP 1065, section 5.5, for the modified one
    truth = np.sqrt((m**2 + 1) / (2 * m**3) if kind == "modified" else 1 / m)[:, None]
    inside = []
    for seed in seeds:
        x = np.random.default_rng(seed).standard_normal((6000, 10))
        found = allan_deviation(x, RATE, kind, taus=tau)
        inside.append((found.low <= truth) & (truth <= found.high))
    share = np.mean(inside, axis=(0, 2))
    assert ((share > 0.9) & (share < 0.99)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_scale_order_and_time(kind, rng):
    x = np.stack([all_sorts(rng, 3000), white(rng, 3000), random_walk(rng, 3000)], axis=1)
    one = allan_deviation(x, RATE, kind)
    scaled = allan_deviation(-7.0 * x, RATE, kind)
    assert np.allclose(scaled.deviation, 7.0 * one.deviation, rtol=1e-12)
    assert np.allclose(scaled.high, 7.0 * one.high, rtol=1e-12)
    turned = allan_deviation(x[:, [2, 0, 1]], RATE, kind)
    assert (turned.deviation == one.deviation[:, [2, 0, 1]]).all()
    backwards = allan_deviation(x[::-1], RATE, kind)
    if kind != "plain":  # which starts at the other end
        assert np.allclose(backwards.deviation, one.deviation, rtol=1e-8)
    faster = allan_deviation(x, 10 * RATE, kind)
    assert np.allclose(faster.tau, one.tau / 10)
    assert (faster.deviation == one.deviation).all()
    alone = allan_deviation(x[:, 1], RATE, kind)
    assert (alone.deviation == one.axis(1).deviation).all()


def test_hadamard_is_blind_to_a_drift(rng):
    x = white(rng, 4000)
    ramp = 0.01 * np.arange(4000)
    taus = [0.1, 1.0, 10.0]
    still = allan_deviation(x, RATE, "hadamard", taus).deviation
    assert np.allclose(allan_deviation(x + ramp, RATE, "hadamard", taus).deviation, still, rtol=1e-9)
    # and Allan sees R τ/√2
    drift = allan_deviation(ramp, RATE, taus=taus)
    assert np.allclose(drift.deviation, 0.01 * RATE * drift.tau / np.sqrt(2), rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_turning_the_sensor_keeps_the_sum_over_its_axes(kind, rng):
    x = np.stack([all_sorts(rng, 2000), white(rng, 2000), random_walk(rng, 2000)], axis=1)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    sums = [np.sum(allan_deviation(y, RATE, kind).deviation ** 2, axis=1) for y in (x, x @ turn)]
    assert np.allclose(*sums, rtol=1e-9)


def test_results_are_read_only(rng):
    found = allan_deviation(white(rng, 100), RATE)
    with pytest.raises(ValueError, match="read-only"):
        found.deviation[0] = 0.0


def test_a_stuck_axis_deviates_by_nothing():
    found = allan_deviation(np.full(100, 0.1), RATE)
    assert np.allclose(found.deviation, 0.0, atol=1e-15)
    assert np.isfinite(found.high).all()


def test_read_only_and_strided_samples_are_taken(rng):
    x = rng.standard_normal((100, 6))
    x.flags.writeable = False
    assert (
        allan_deviation(x[:, ::2], RATE).deviation == allan_deviation(x[:, ::2].copy(), RATE).deviation
    ).all()


@pytest.mark.parametrize(
    ("x", "rate", "kind", "taus", "error", "says"),
    [
        (np.ones(7), 1.0, "overlapping", None, DataError, "needs 8 samples at least, got 7"),
        (np.ones((9, 2, 2)), 1.0, "overlapping", None, ShapeError, r"\(N,\) or \(N, k\), got \(9, 2, 2\)"),
        (np.ones(9), 0.0, "overlapping", None, DataError, "rate of the samples in Hz"),
        ([*np.ones(9), np.nan], 1.0, "overlapping", None, NotFiniteError, "nan at sample 9 of axis 0"),
        (np.ones(9), 1.0, "total", None, DataError, "kind is 'total'; there are overlapping, hadamard"),
        (np.ones(9), 10.0, "overlapping", [0.1, 2.0], DataError, "9 samples at 10 Hz allow 0.1 to 0.4 s"),
        (np.ones(9), 10.0, "overlapping", [0.01], DataError, "do not all fit"),
        (np.ones(9), 10.0, "overlapping", [np.inf], DataError, "finite averaging times"),
    ],
)  # fmt: skip
def test_bad_input_is_answered_by_a_sentence(x, rate, kind, taus, error, says):
    with pytest.raises(error, match=says):
        allan_deviation(x, rate, kind, taus)


def test_one_axis_has_no_axis_to_choose(rng):
    with pytest.raises(ShapeError, match="one axis"):
        allan_deviation(white(rng, 20), RATE).axis(0)
