"""Tuning on a real drive, from the used fixes alone, scored on the fixes held out."""

from dataclasses import replace

import numpy as np
import pytest

import sequential as sq
from factorlab.datasets import load


@pytest.fixture(scope="module")
def drive():
    return load("kitti", use_every=5)[0]


@pytest.fixture(scope="module", params=[1.0, 3.0, 1 / 3.0], ids=["shipped", "x3", "/3"])
def tuning(request, drive):
    return sq.tune(
        drive.build, [replace(knob, initial=knob.initial * request.param) for knob in drive.knobs], drive.log
    )


def score(drive, values, estimator):
    run = sq.run(estimator, drive.build(values), drive.log, at=drive.held_out.t)
    error = run.mean[run.index(drive.held_out.t)][:, 4:7] - drive.held_out.values
    return float(np.sqrt((error**2).sum(axis=1).mean())), run


def test_held_out_fixes_are_met_wherever_the_search_starts(drive, tuning):
    rmse, run = score(drive, tuning.values, sq.ExtendedKalmanFilter())
    assert rmse == pytest.approx(1.522, rel=0.02)
    assert 2.5 < run.innovations["gps"].nis().mean() < 3.5
    rmse, _ = score(drive, tuning.values, sq.IteratedSmoother())
    assert rmse == pytest.approx(0.192, rel=0.02)


def test_the_search_says_how_well_it_knows(drive, tuning):
    assert tuning.converged
    assert tuning.message == ""
    assert tuning.evaluations < 350
    # densities are in every sample, bias walks hardly show in 90 fixes
    assert tuning.decades["gyro_density"] < 0.05
    assert tuning.decades["accel_density"] < 0.08
    assert 0.2 < tuning.decades["accel_bias_walk"] < 1.0
    shipped = {knob.name: knob.initial for knob in drive.knobs}
    assert tuning.values["accel_density"] / shipped["accel_density"] == pytest.approx(7.6, rel=0.05)
    assert tuning.values["gyro_density"] / shipped["gyro_density"] == pytest.approx(28.5, rel=0.05)


def test_the_unscented_filter_manages_the_drive(drive):
    """47 thousand steps of 15 states with 31 points each."""
    values = {knob.name: knob.initial for knob in drive.knobs}
    extended, _ = score(drive, values, sq.ExtendedKalmanFilter())
    unscented, _ = score(drive, values, sq.UnscentedKalmanFilter())
    assert unscented == pytest.approx(extended, rel=0.01)
    smoothed, _ = score(drive, values, sq.RauchTungStriebel(sq.UnscentedKalmanFilter()))
    assert smoothed < 1.10
