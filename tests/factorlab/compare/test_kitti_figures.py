"""The figures that the project promises on KITTI, from the command's own document."""

import pytest

from factorlab.compare import NAMES, compare, document
from factorlab.datasets import load


@pytest.fixture(scope="module")
def whole():
    (kitti,) = load("kitti", use_every=5)
    return document((compare(kitti, NAMES, tune=True),), "factorlab compare kitti --tune")


def rmse(rows, name):
    return rows[name]["held_out_rmse_m"]


def test_every_name_has_a_row(whole):
    assert set(whole["estimators"]) == set(whole["untuned"]) == set(NAMES)
    assert not [name for name in NAMES if whole["estimators"][name]["held_out_rmse_m"] is None]


def test_shipped_noise(whole):
    assert rmse(whole["untuned"], "batch") <= 1.10
    assert rmse(whole["untuned"], "ekf") <= 3.9


def test_tuned_noise(whole):
    tuned = whole["estimators"]
    assert rmse(tuned, "batch") <= 0.20
    assert rmse(tuned, "ekf") <= 1.55
    assert tuned["ekf"]["nis"]["inside"]
    assert 1.0 <= tuned["batch"]["normalised_error"]["mean"] <= 3.5


@pytest.mark.parametrize("table", ["estimators", "untuned"])
def test_smoothers_agree(whole, table):
    rows = whole[table]
    assert rmse(rows, "ieks") == pytest.approx(rmse(rows, "batch"), rel=1e-3)
    assert rmse(rows, "ekf_rts") == pytest.approx(rmse(rows, "batch"), rel=1e-2)
    assert rmse(rows, "isam2_final") == pytest.approx(rmse(rows, "batch"), rel=2e-2)


def test_the_shipped_noise_is_diagnosed():
    (kitti,) = load("kitti", use_every=5)
    worst = [f for f in compare(kitti, ("ekf",)).findings if f.status == "FAIL"]
    assert any("densities about 15x too small" in f.meaning for f in worst)
