"""χ² bands, NIS, NEES, normalised errors: exact against SciPy, and by Monte Carlo."""

import numpy as np
import pytest
from scipy.stats import chi2

from sequential.errors import NotPositiveDefiniteError, ShapeError
from sequential.evaluate import anees, chi2_band, nees, nis_summary, normalised_error, summarise
from sequential.history import Innovations, Report, Run
from sequential.manifold import SE2, SE3, NavState, Product, Vector


def innovations_of(residual, cov, accepted=None):
    count = len(residual)
    accepted = np.ones(count, bool) if accepted is None else accepted
    return Innovations(np.arange(count), np.arange(count), residual, cov, accepted)


def run_of(manifold, mean, cov):
    t = np.arange(len(mean), dtype=np.int64)
    return Run(t, mean, cov, manifold, {}, 0.0, Report("test"))


def random_covariances(rng, count, dim, scale=1.0):
    roots = rng.standard_normal((count, dim, dim)) + 2 * np.eye(dim)
    return scale**2 * roots @ roots.transpose(0, 2, 1)


@pytest.mark.parametrize(("dof", "n", "level"), [(1, 1, 0.95), (3, 94, 0.95), (3, 1, 0.99), (15, 1000, 0.5)])
def test_the_band_is_scipys(dof, n, level):
    expected = chi2.ppf([(1 - level) / 2, (1 + level) / 2], n * dof) / n
    np.testing.assert_allclose(chi2_band(dof, n, level), expected, rtol=1e-12)


@pytest.mark.parametrize("bad", [(0, 5, 0.95), (3, 0, 0.95), (3, 5, 1.0)])
def test_a_band_of_nothing_is_refused(bad):
    with pytest.raises(ShapeError, match="dof >= 1, n >= 1 and 0 < level < 1"):
        chi2_band(*bad)


def test_the_band_holds_the_mean_nineteen_times_in_twenty(rng):
    low, high = chi2_band(3, 50)
    means = rng.chisquare(3, (4000, 50)).mean(axis=1)
    assert np.mean((means > low) & (means < high)) == pytest.approx(0.95, abs=0.015)


def test_a_consistent_sensor_is_called_consistent(rng):
    cov = random_covariances(rng, 2000, 3)
    residual = np.einsum("nij,nj->ni", np.linalg.cholesky(cov), rng.standard_normal((2000, 3)))
    found = nis_summary(innovations_of(residual, cov))
    assert found.inside_band
    assert found.verdict == "consistent"
    assert found.tail_share == pytest.approx(0.05, abs=0.02)
    assert found.median == pytest.approx(found.expected_median, rel=0.06)
    assert (found.dof, found.expected, found.count, found.kind) == (3, 3.0, 2000, "filter")


@pytest.mark.parametrize(("scale", "verdict"), [(5.4, "overconfident"), (0.2, "pessimistic")])
def test_the_factor_says_how_far_off_the_deviations_are(scale, verdict, rng):
    residual = scale * rng.standard_normal((3000, 2))
    found = nis_summary(innovations_of(residual, np.broadcast_to(np.eye(2), (3000, 2, 2))))
    assert found.verdict == verdict
    assert found.factor == pytest.approx(scale, rel=0.05)


def test_gated_readings_are_counted_and_left_out_of_the_mean():
    residual = np.array([[1.0], [1.0], [100.0], [1.0]])
    accepted = np.array([True, True, False, True])
    found = nis_summary(innovations_of(residual, np.ones((4, 1, 1)), accepted))
    assert found.mean == 1.0
    assert (found.fraction_gated, found.count) == (0.25, 3)


@pytest.mark.parametrize(("gated", "share"), [(0, 0.0), (7, 1.0)])
def test_no_reading_is_no_verdict(gated, share):
    found = summarise([], 3, "filter", gated)
    assert (found.verdict, found.count, found.fraction_gated) == ("no data", 0, share)


@pytest.mark.parametrize("manifold", [Vector(4), SE2(), SE3(), NavState(), Product(a=SE2(), b=Vector(2))])
def test_nees_of_draws_from_the_belief_is_chi_square(manifold, rng):
    d, count = manifold.dim, 1500
    cov = random_covariances(rng, count, d, scale=0.02)
    mean = manifold.random(rng, shape=(count,))
    draw = np.einsum("nij,nj->ni", np.linalg.cholesky(cov), rng.standard_normal((count, d)))
    values = nees(run_of(manifold, mean, cov), manifold.retract(mean, draw))
    np.testing.assert_allclose(values, np.einsum("ni,nij,nj->n", draw, np.linalg.inv(cov), draw), rtol=1e-6)
    low, high = chi2_band(d, count, 0.999)
    assert low < values.mean() < high


def test_nees_of_a_part_takes_its_own_block(rng):
    manifold = Product(pose=SE2(), bias=Vector(2))
    mean, cov = manifold.random(rng, shape=(5,)), random_covariances(rng, 5, 5)
    step = 0.1 * rng.standard_normal((5, 5))
    truth, run = manifold.retract(mean, step), run_of(manifold, mean, cov)
    expected = np.einsum("ni,nij,nj->n", step[:, :3], np.linalg.inv(cov[:, :3, :3]), step[:, :3])
    for part, given in [("pose", truth), ("pose", truth[:, :3]), ([0, 1, 2], truth)]:
        np.testing.assert_allclose(nees(run, given, part=part), expected, rtol=1e-9)
    mask = np.array([False, False, False, True, True])
    np.testing.assert_allclose(nees(run, truth, part=mask), nees(run, truth, part="bias"), rtol=1e-12)
    rows = np.array([3, 1])
    np.testing.assert_allclose(nees(run, truth[rows], part="pose", rows=rows), expected[rows], rtol=1e-9)


def test_nees_says_what_does_not_fit(rng):
    run = run_of(Vector(2), np.zeros((3, 2)), np.zeros((3, 2, 2)))
    with pytest.raises(ShapeError, match=r"the truth must have shape \(3, 2\).*got \(2, 2\)"):
        nees(run, np.zeros((2, 2)))
    with pytest.raises(ShapeError, match="has no part 'pose'"):
        nees(run, np.zeros((3, 2)), part="pose")
    with pytest.raises(NotPositiveDefiniteError, match="leave out directions that are known exactly"):
        nees(run, np.zeros((3, 2)))


def test_a_normalised_error_counts_both_covariances(rng):
    cov, noise = random_covariances(rng, 4000, 3), np.diag([1.0, 4.0, 9.0])
    total = cov + noise
    error = np.einsum("nij,nj->ni", np.linalg.cholesky(total), rng.standard_normal((4000, 3)))
    values = normalised_error(np.zeros((4000, 3)), cov, error, noise)
    assert summarise(values, 3, "held-out", level=0.999).inside_band
    with pytest.raises(ShapeError, match=r"errors \(N, m\) need covariances"):
        normalised_error(np.zeros((4, 3)), np.eye(2), np.zeros((4, 3)), 0.0)


def test_anees_of_consistent_runs_stays_inside_its_band(rng):
    found = anees(list(rng.chisquare(6, (40, 500))), dof=6)
    assert found.average.shape == (500,)
    assert found.band == chi2_band(6, 40)
    assert found.share_inside == pytest.approx(0.95, abs=0.04)
    assert found.mean == pytest.approx(6.0, rel=0.02)
    with pytest.raises(ShapeError, match="runs of one length"):
        anees([np.ones(3), np.ones(4)], 6)
