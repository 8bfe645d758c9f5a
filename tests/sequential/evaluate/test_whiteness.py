"""Whiteness of innovations: the size of the test, and its power against what it is for."""

import numpy as np
import pytest

from sequential.errors import ShapeError
from sequential.evaluate import autocorrelation, whiteness
from sequential.history import Innovations


def innovations_of(white, accepted=None):
    n, m = white.shape
    cov = np.broadcast_to(4.0 * np.eye(m), (n, m, m))
    accepted = np.ones(n, bool) if accepted is None else accepted
    return Innovations(np.arange(n), np.arange(n), 2.0 * white, cov, accepted)


def coloured(rng, n, m, phi):
    values = rng.standard_normal((n, m))
    for k in range(1, n):
        values[k] = phi * values[k - 1] + np.sqrt(1 - phi**2) * values[k]
    return values


def test_white_innovations_pass_nineteen_times_in_twenty(rng):
    found = [whiteness(innovations_of(rng.standard_normal((300, 2)))) for _ in range(300)]
    assert np.mean([w.white for w in found]) == pytest.approx(0.95, abs=0.04)
    assert np.mean([w.unbiased for w in found]) == pytest.approx(0.95, abs=0.04)
    assert np.mean([w.share_outside for w in found]) == pytest.approx(0.05, abs=0.015)


def test_correlated_innovations_are_found(rng):
    found = whiteness(innovations_of(coloured(rng, 400, 3, 0.4)))
    assert found.verdict in {"correlated", "correlated and biased"}
    np.testing.assert_allclose(found.correlation[0], 0.4, atol=0.15)
    assert found.bound == pytest.approx(1.96 / 20, rel=1e-3)


def test_a_bias_is_found_and_is_not_taken_for_correlation(rng):
    found = whiteness(innovations_of(rng.standard_normal((400, 2)) + np.array([0.5, 0.0])))
    assert found.verdict == "biased"
    assert found.mean[0] == pytest.approx(0.5, abs=0.2)


def test_gated_readings_are_left_out(rng):
    white = rng.standard_normal((100, 1))
    white[::10] = 50.0
    found = whiteness(innovations_of(white, accepted=white[:, 0] < 40))
    assert found.count == 90
    assert found.unbiased


def test_the_statistic_is_ljung_and_boxs():
    values = np.array([1.0, -1.0, 2.0, 0.5, -0.7, 0.1, 1.4, -2.0, 0.3, -1.6])[:, None]
    centred = values - values.mean()
    r = [float((centred[k:] * centred[:-k]).sum() / (centred**2).sum()) for k in (1, 2)]
    found = whiteness(innovations_of(values), lags=2)
    np.testing.assert_allclose(found.correlation[:, 0], r, rtol=1e-12)
    assert found.statistic == pytest.approx(10 * 12 * (r[0] ** 2 / 9 + r[1] ** 2 / 8))


def test_a_constant_column_has_no_correlation():
    assert autocorrelation(np.ones((20, 1)), 3).tolist() == [[0.0]] * 3


def test_a_handful_of_readings_is_refused(rng):
    with pytest.raises(ShapeError, match="ten readings or more"):
        whiteness(innovations_of(rng.standard_normal((9, 1))))
