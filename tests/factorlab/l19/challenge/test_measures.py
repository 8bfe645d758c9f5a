"""The numbers of a filter, held against filters whose numbers are known."""

import numpy as np
import pytest

import sequential as sq
from factorlab.l19.challenge import hidden_trials, measured_filter, public_trial
from factorlab.l19.challenge.measures import NEVER_S
from factorlab.l19.challenge.rivals import OURS, kalman, rivals, tuned_noise

TRIALS = hidden_trials(seed=7, count=4)


def oracle(trials):
    """The truth itself, whatever is measured: found by the readings."""
    known = {trial.z.tobytes(): trial.truth for trial in trials}
    known |= {trial.without_outlier.tobytes(): trial.truth for trial in trials}
    return lambda _, z: known.get(z.tobytes(), z)


def test_the_truth_has_no_error():
    found = measured_filter(oracle(TRIALS), TRIALS)
    assert (found.ramp, found.plateau, found.outlier, found.delay_s) == (0.0, 0.0, 0.0, 0.0)
    assert found.nees is None


def test_readings_themselves_have_the_noise_and_the_outlier():
    found = measured_filter(lambda _, z: z, TRIALS)
    assert found.delay_s == 0.0
    assert found.outlier == pytest.approx(np.mean([abs(trial.outlier) for trial in TRIALS]))
    assert found.ramp > np.mean([trial.sigma for trial in TRIALS])


@pytest.mark.parametrize("smooth", [sq.LowPass(coefficient=0.2, interval=1.0), sq.MovingMean(9)])
def test_the_delay_of_a_linear_filter_is_its_own(smooth):
    assert measured_filter(smooth, TRIALS).delay_s == smooth.response(1.0).delay_90


def test_a_filter_that_never_moves_never_arrives():
    assert measured_filter(lambda _, z: np.full(len(z), z[0]), TRIALS).delay_s == NEVER_S


def test_the_outlier_passes_a_low_pass_by_its_coefficient():
    found = measured_filter(sq.LowPass(coefficient=0.2, interval=1.0), TRIALS)
    assert found.outlier == pytest.approx(0.2 * np.mean([abs(trial.outlier) for trial in TRIALS]))


def test_a_sigma_twice_too_small_has_four_times_the_nees():
    tuned = tuned_noise(public_trial())
    honest = kalman(tuned.q, tuned.R)

    def boastful(t, z):
        return honest(t, z) * [1.0, 0.5]

    assert measured_filter(boastful, TRIALS).nees == pytest.approx(4 * measured_filter(honest, TRIALS).nees)


def test_ours_wins_where_it_counts():
    table = {n: measured_filter(f, hidden_trials()) for n, f in rivals(tuned_noise(public_trial())).items()}
    ours = table.pop(OURS)
    assert ours.ramp < 0.6 * min(one.ramp for one in table.values())
    assert ours.outlier < min(one.outlier for one in table.values())
    assert ours.plateau < 0.5 * table["mesures brutes"].plateau
    assert 0.6 < ours.nees < 1.6
