"""A driven camera among known points: estimates that agree, and that know how wrong they are."""

import numpy as np
import pytest
from stereo_night_worlds import night

import sequential as sq


@pytest.mark.slow
@pytest.mark.parametrize("estimator", [sq.ExtendedKalmanFilter(), sq.RauchTungStriebel(leave_one_out=False)])
def test_estimates_know_how_wrong_they_are(estimator, seeds):
    """NEES of the pose over draws of the model itself."""
    errors, covs = [], []
    for seed in seeds:
        one = night(np.random.default_rng(seed))
        run = sq.run(estimator, one.model, one.log)
        errors.append(sq.SE3().local(run.mean, one.truth[run.index(run.t)])[::10])
        covs.append(run.cov[::10])
    found = np.einsum(
        "sni,sni->sn", np.stack(errors), np.linalg.solve(np.stack(covs), np.stack(errors)[..., None])[..., 0]
    )
    per_run = found.mean(axis=1)
    assert per_run.mean() / 6 == pytest.approx(1.0, abs=4 * per_run.std() / 6 / np.sqrt(len(per_run)) + 0.02)


def test_six_estimators_agree_on_a_mild_night(rng):
    one = night(rng, count=40)
    runs = [
        sq.run(estimator, one.model, one.log)
        for estimator in (sq.RauchTungStriebel(leave_one_out=False), sq.IteratedSmoother(leave_one_out=False))
    ]
    assert np.abs(sq.SE3().local(runs[0].mean, runs[1].mean)).max() < 2e-3
    filters = [
        sq.run(estimator, one.model, one.log)
        for estimator in (
            sq.ExtendedKalmanFilter(),
            sq.IteratedExtendedKalmanFilter(),
            sq.UnscentedKalmanFilter(),
        )
    ]
    for run in filters[1:]:
        assert np.abs(sq.SE3().local(filters[0].mean, run.mean)).max() < 5e-3
