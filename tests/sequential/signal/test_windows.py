"""Means, medians and outliers of sliding windows, held to the plainest possible code and to SciPy."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from sequential.signal import SIGMA_PER_MAD, Hampel, MovingMean, SlidingMedian
from sequential.signal.sliding_median import median_sigma

WINDOWS = [(k, centred) for k in (1, 2, 3, 4, 7, 10, 31) for centred in (False, True)]


def windows(x, k, centred, edges):
    """The samples of every window, one by one."""
    ahead = (k - 1) // 2 if centred else 0
    behind = k - 1 - ahead
    if edges in {"nearest", "reflect"}:
        x = np.pad(x, (behind, ahead), mode={"nearest": "edge", "reflect": "symmetric"}[edges])
        return [x[i : i + k] for i in range(len(x) - k + 1)]
    short = [x[max(0, i - behind) : i + ahead + 1] for i in range(len(x))]
    return [w if edges == "shrink" or len(w) == k else w[:0] for w in short]


def plain(function, pieces):
    kept = [w[~np.isnan(w)] for w in pieces]
    return np.array([function(w) if len(w) else np.nan for w in kept])


def holey(rng, n=400):
    x = np.round(rng.standard_normal(n), 1)  # many ties
    x[rng.random(n) < 0.15] = np.nan
    x[50:85] = np.nan  # longer than any window
    return x


@pytest.mark.parametrize(
    ("k", "centred", "edges"),
    [
        (k, centred, edges)
        for k, centred in WINDOWS
        for edges in ("shrink", "nearest", "reflect", "nan")
        if centred or edges != "reflect"
    ],
)
def test_against_the_plainest_code(k, centred, edges, rng):
    x = holey(rng)
    pieces = windows(x, k, centred, edges)
    median = plain(np.median, pieces)
    np.testing.assert_array_equal(SlidingMedian(k, centred, edges)(x), median)
    np.testing.assert_allclose(MovingMean(k, centred, edges)(x), plain(np.mean, pieces), rtol=0, atol=1e-15)
    spread = Hampel(k, centred, edges, threshold=1.5).spread(x)
    mad = [
        plain(np.median, [np.abs(w - m)])[0] if len(w) else np.nan
        for w, m in zip(pieces, median, strict=True)
    ]
    np.testing.assert_allclose(spread.sigma, SIGMA_PER_MAD * np.array(mad), rtol=1e-15)
    with np.errstate(invalid="ignore"):
        outlier = np.abs(x - median) > 1.5 * spread.sigma
    assert np.array_equal(spread.outlier, outlier)
    if edges != "reflect" and not centred:
        np.testing.assert_array_equal(list(SlidingMedian(k, centred, edges).online(x.tolist())), median)


@pytest.mark.parametrize("k", [3, 9, 51])
@pytest.mark.parametrize(("edges", "mode"), [("nearest", "nearest"), ("reflect", "reflect")])
def test_scipy_gives_the_same_medians(k, edges, mode, rng):
    x = rng.standard_normal(5000)
    assert np.array_equal(SlidingMedian(k, True, edges)(x), ndimage.median_filter(x, size=k, mode=mode))


@given(
    x=st.lists(
        st.one_of(st.integers(-3, 3).map(float), st.just(float("nan")), st.floats(-1e300, 1e300)), max_size=40
    ),
    k=st.integers(1, 50),
    centred=st.booleans(),
)
def test_any_series_and_any_window(x, k, centred):
    pieces = windows(np.array(x), k, centred, "shrink")
    np.testing.assert_array_equal(
        SlidingMedian(k, centred)(np.array(x)),
        plain(lambda w: 0.5 * (np.sort(w)[(len(w) - 1) // 2] + np.sort(w)[len(w) // 2]), pieces),
    )


def test_pieces_do_not_show(rng):
    """Long enough to be cut into many pieces, and windows longer than one."""
    x = rng.standard_normal(40_000)
    for k in (5, 9001):
        rows = rng.integers(0, len(x), 50)
        y = SlidingMedian(k)(x)
        assert [y[i] for i in rows] == [np.median(x[max(0, i - k + 1) : i + 1]) for i in rows]


def test_a_million_samples_take_a_second_whatever_the_window(rng):
    x = rng.standard_normal(300_000)
    seconds = {}
    for k in (11, 101, 10_001):
        began = time.process_time()
        SlidingMedian(k)(x)
        seconds[k] = time.process_time() - began
    assert max(seconds.values()) < 3.0
    assert seconds[10_001] < 6.0 * seconds[11]  # 900 times the window, log k twice as long


def test_a_large_value_leaves_nothing_behind():
    x = np.full(100, 0.1)
    x[40] = 1e17
    assert MovingMean(10)(x)[50:] == pytest.approx(np.full(50, 0.1), rel=1e-15)


@pytest.mark.parametrize("k", [1, 2, 3, 4, 7, 8, 30])
def test_the_spread_of_a_median_of_normals(k, rng):
    sampled = np.std(np.median(rng.standard_normal((100_000, k)), axis=1))
    assert median_sigma(k) == pytest.approx(sampled, rel=0.01)


def test_the_spread_of_a_median_in_closed_form():
    assert median_sigma(1) == pytest.approx(1.0, rel=1e-10)
    assert median_sigma(2) == pytest.approx(np.sqrt(0.5), rel=1e-8)
    # Jones 1948, Exact lower moments of order statistics in small samples from a normal distribution
    assert median_sigma(3) ** 2 == pytest.approx(1 - np.sqrt(3) / np.pi, rel=1e-9)
    even = [median_sigma(k) for k in (98, 100, 102, 104)]
    np.testing.assert_allclose(np.diff(even)[1:], np.diff(even)[:-1], rtol=0.1)  # no step between two ways
    assert median_sigma(100_000) == pytest.approx(np.sqrt(np.pi / 2 / 100_000), rel=1e-4)
    assert median_sigma(100_001) == pytest.approx(np.sqrt(np.pi / 2 / 100_001), rel=1e-4)


def test_the_median_removes_outliers_but_not_gaussian_noise(rng):
    """The course's claim, in numbers: at a given window, a mean removes noise better and outliers worse."""
    noise = rng.standard_normal(20_000)
    spikes = np.where(rng.random(20_000) < 0.02, 50.0, 0.0)
    mean, median = MovingMean(9, centred=True), SlidingMedian(9, centred=True)
    assert np.std(mean(noise)) < 0.85 * np.std(median(noise))
    assert np.std(median(noise)) > 0.35
    assert np.max(np.abs(median(spikes))) == 0.0
    assert np.std(mean(spikes)) > 2.0


def test_hampel_finds_spikes_and_keeps_the_rest(rng):
    noise = 0.5 * rng.standard_normal(20_000)
    at = rng.choice(20_000, 100, replace=False)
    x = noise.copy()
    x[at] += np.where(rng.random(100) < 0.5, 8.0, -8.0)
    found = Hampel(15, centred=True, threshold=4.0)
    mask = found.outliers(x)
    assert mask[at].all()
    assert mask.sum() - 100 < 0.005 * len(x)  # of the Gaussian samples
    kept = ~mask
    assert np.array_equal(found(x)[kept], x[kept])
    assert np.std(found(x) - noise) < 0.1


def test_a_burst_far_away_does_not_open_the_gate_here(rng):
    """Why the spread is local: a noisy minute would hide the spikes of a quiet one from a global MAD."""
    x = np.concatenate([0.1 * rng.standard_normal(2000), 5.0 * rng.standard_normal(3000)])
    x[1000] += 3.0
    assert Hampel(21, centred=True, threshold=5.0).outliers(x)[1000]
    global_sigma = SIGMA_PER_MAD * np.median(np.abs(x - np.median(x)))
    assert abs(x[1000] - np.median(x)) < 5.0 * global_sigma


def test_a_spread_of_zero():
    x = np.zeros(30)
    x[[10, 20]] = 5.0, 0.1
    assert np.flatnonzero(Hampel(7).outliers(x)).tolist() == [10, 20]
    assert np.flatnonzero(Hampel(7, floor=0.1).outliers(x)).tolist() == [10]
    assert not Hampel(7).outliers(np.full(30, 3.3)).any()
    assert not Hampel(1).outliers(np.arange(5.0)).any()


def test_a_causal_hampel_takes_a_step_for_outliers_until_half_the_window_has_seen_it():
    x = np.repeat([0.0, 1.0], 20)
    assert np.flatnonzero(Hampel(7).outliers(x)).tolist() == [20, 21, 22]
    assert not Hampel(7, centred=True).outliers(x).any()
