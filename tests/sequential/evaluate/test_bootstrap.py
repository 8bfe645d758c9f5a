"""The block bootstrap: groups stay together, and the band covers what it says."""

import numpy as np
import pytest

from sequential.errors import ShapeError
from sequential.evaluate import block_bootstrap, gap_labels


def test_gaps_are_labelled_by_the_used_readings_around_them():
    used = np.array([10, 20, 30])
    assert gap_labels([5, 11, 12, 19, 20, 25, 35], used).tolist() == [0, 1, 1, 1, 2, 2, 3]


@pytest.mark.parametrize("statistic", ["mean", "median"])
def test_equal_seeds_give_equal_bands(statistic):
    values, groups = np.arange(60.0) ** 2, np.repeat(np.arange(15), 4)
    bands = [block_bootstrap(values, groups, np.random.default_rng(3), statistic=statistic) for _ in range(2)]
    assert bands[0] == bands[1]
    assert bands[0].low < bands[0].value < bands[0].high
    assert bands[0].blocks == 15
    assert bands[0].value == (values.mean() if statistic == "mean" else np.median(values))


@pytest.mark.parametrize("statistic", ["mean", "median"])
def test_the_weighted_resamples_are_the_spelled_out_ones(statistic):
    rng = np.random.default_rng(8)
    groups = rng.integers(0, 7, 40)
    values = rng.standard_normal(40)
    band = block_bootstrap(values, groups, np.random.default_rng(4), statistic=statistic, resamples=300)
    draws = np.random.default_rng(4).multinomial(7, np.full(7, 1 / 7), size=300)
    take = np.mean if statistic == "mean" else np.median
    spelled = [
        take(np.concatenate([values[groups == g] for g in range(7) for _ in range(draw[g])]))
        for draw in draws
    ]
    np.testing.assert_allclose([band.low, band.high], np.quantile(spelled, [0.025, 0.975]), rtol=1e-12)


def test_bands_of_correlated_groups_cover_and_naive_ones_do_not(seeds):
    covered, naive = 0, 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        values = np.repeat(rng.chisquare(3, 90), 4)  # four fixes of a gap that say the same
        covered += block_bootstrap(values, np.repeat(np.arange(90), 4), rng, resamples=400).holds(3.0)
        naive += block_bootstrap(values, np.arange(360), rng, resamples=400).holds(3.0)
    assert covered >= 0.8 * len(seeds)
    assert naive < covered


def test_what_cannot_be_resampled_is_refused(rng):
    with pytest.raises(ShapeError, match="two groups or more, got 1"):
        block_bootstrap([1.0, 2.0], [0, 0], rng)
    with pytest.raises(ShapeError, match="one label each"):
        block_bootstrap([1.0, 2.0], [0, 0, 1], rng)
    with pytest.raises(ShapeError, match="'mean' or 'median', got 'mode'"):
        block_bootstrap([1.0, 2.0], [0, 1], rng, statistic="mode")
