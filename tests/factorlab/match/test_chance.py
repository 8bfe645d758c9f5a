"""The test of chance: calibrated by random matches, and blind to points that are the same."""

import numpy as np
import pytest
from scipy.stats import binom

from factorlab.match import MatchSettings
from factorlab.match.chance import chance_agreement, distinct_rows, log10_false_alarms
from factorlab.match.fitting import fit_model
from vision3d.robust import transfer

H = np.array([[0.9, 0.1, 20.0], [-0.05, 1.1, 5.0], [1e-4, 0.0, 1.0]])


def heaps(rng, count):
    """Points of a picture as detectors give them: in heaps, not evenly."""
    centres = rng.uniform((50, 50), (590, 430), (6, 2))
    return centres[rng.integers(0, 6, count)] + rng.normal(0, 15, (count, 2))


@pytest.mark.parametrize("kind", ["homography", "fundamental"])
def test_random_matches_are_chance(kind, rng):
    said = []
    for _ in range(25):
        many = int(rng.integers(20, 150))
        found = fit_model(kind, heaps(rng, many), heaps(rng, many), MatchSettings(), rng=rng)
        said.append(1.0 if found is None else found.chance_log10)
    assert min(said) > -2.5


@pytest.mark.parametrize("outliers", [0.0, 0.5, 0.8])
def test_right_matches_are_none(outliers, rng):
    a = heaps(rng, 120)
    b = transfer(H, a) + rng.normal(0, 0.5, a.shape)
    wrong = round(outliers * len(a))
    b[:wrong] = heaps(rng, wrong)
    found = fit_model("homography", a, b, MatchSettings(), rng=rng)
    assert found.chance_log10 < -10


def test_alpha_is_the_share_of_wrong_pairings(rng):
    a, b = rng.uniform(0, 400, (500, 2)), rng.uniform(0, 400, (500, 2))
    alpha = chance_agreement(np.eye(3), "homography", a, b, 12.0)
    assert alpha == pytest.approx(np.pi * 12.0**2 / 400**2, rel=0.15)


def test_the_number_bounds_the_binomial_tail():
    """With one model tried it is above the probability that so many agree; more models cost more."""
    for n, k, alpha in ((100, 12, 0.01), (300, 40, 0.05), (50, 45, 0.3)):
        tail = binom.logsf(k - 5, n - 4, alpha) / np.log(10)
        assert log10_false_alarms(n, k, 4, alpha) > tail
    assert log10_false_alarms(10, 4, 4, 0.01) == pytest.approx(1.0)
    more = [log10_false_alarms(100, k, 4, 0.01) for k in (6, 10, 20, 60)]
    assert (np.diff(more) < 0).all()


def test_a_point_found_twice_counts_once(rng):
    a, b = rng.uniform(0, 500, (30, 2)), rng.uniform(0, 500, (30, 2))
    twice = np.vstack([a, a + 0.5]), np.vstack([b, b + 0.5])
    kept = distinct_rows(*twice)
    assert kept[:30].sum() >= 29
    assert not kept[30:].any()
    assert distinct_rows(a[:1], b[:1]).tolist() == [True]
