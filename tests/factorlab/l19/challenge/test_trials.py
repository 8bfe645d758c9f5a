"""Recordings of the thermometer are what the statement says, and the hidden ones differ."""

import numpy as np
import pytest

from factorlab.l19.challenge import hidden_trials, public_trial


def test_the_public_recording_is_the_statement_s():
    trial = public_trial()
    np.testing.assert_allclose(np.diff(trial.t), 1.0)
    np.testing.assert_allclose(np.diff(trial.truth), np.where(np.arange(239) < 120, 0.25, 0.0), atol=1e-12)
    assert (trial.sigma, trial.outlier, trial.outlier_at) == (0.5, 8.0, 40)
    noise = trial.without_outlier - trial.truth
    assert np.std(noise) == pytest.approx(0.5, rel=0.15)
    assert trial.z[40] - trial.without_outlier[40] == 8.0
    np.testing.assert_array_equal(public_trial().z, trial.z)


def test_hidden_recordings_differ_in_everything():
    trials = hidden_trials()
    for name in ("sigma", "bend", "outlier_at", "outlier"):
        assert len({getattr(trial, name) for trial in trials}) > len(trials) // 2
    assert {np.sign(trial.outlier) for trial in trials} == {-1.0, 1.0}
    assert {np.sign(trial.truth[-1] - trial.truth[0]) for trial in trials} == {-1.0, 1.0}


def test_a_seed_is_a_set():
    one, same, other = hidden_trials(3), hidden_trials(3), hidden_trials(4)
    assert all(np.array_equal(a.z, b.z) for a, b in zip(one, same, strict=True))
    assert not any(np.array_equal(a.z, b.z) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("trial", [public_trial(), *hidden_trials(count=3)])
def test_ramp_and_plateau_are_told_apart(trial):
    assert np.ptp(np.diff(trial.truth[trial.ramp])) < 1e-9
    assert np.ptp(trial.truth[trial.plateau]) == 0.0
    assert np.ptp(trial.truth[trial.rest]) == 0.0
    assert trial.ramp.stop < trial.plateau.start < trial.rest.start
    assert len(trial.z[trial.rest]) == 30
