"""KITTI from the gtsam wheel: its facts, its traps, and the figures that every later change must keep."""

import numpy as np
import pytest

from factorlab.datasets import load
from sequential import ExtendedKalmanFilter, IteratedSmoother, run


@pytest.fixture(scope="module")
def kitti():
    (dataset,) = load("kitti")
    return dataset


def test_counts(kitti):
    assert len(kitti.log["imu"]) == 46_968 - 1, "the first row covers 46 534 s"
    assert len(kitti.log["gps"]) == 93
    assert len(kitti.held_out) == 375
    # 470 fixes: the first precedes the IMU's first whole second, the second is the prior's.
    assert len(kitti.log["gps"]) + len(kitti.held_out) == 470 - 2
    assert kitti.axes == 3
    assert kitti.truth is None


def test_an_interval_lies_before_its_stamp(kitti):
    imu = kitti.log["imu"]
    assert imu.covers == "before"
    steps = np.diff(imu.t) * 1e-9
    assert 0.0095 < np.median(steps) < 0.0105


def test_no_held_out_fix_is_used_and_none_of_the_prior(kitti):
    used, held = set(kitti.log["gps"].t.tolist()), set(kitti.held_out.t.tolist())
    assert not used & held
    assert min(used | held) > kitti.model.start_ns


def test_one_in_one_holds_nothing_out():
    (dataset,) = load("kitti", use_every=1)
    assert dataset.held_out is None
    assert len(dataset.log["gps"]) == 468


def test_knobs_build_the_shipped_model(kitti):
    values = {knob.name: knob.initial for knob in kitti.knobs}
    assert list(values) == ["accel_density", "gyro_density", "accel_bias_walk", "gyro_bias_walk", "gps_sigma"]
    assert values["accel_density"] == 0.01
    assert values["gyro_density"] == 0.000175
    # per sample at 100 Hz in the file: times ten as densities
    np.testing.assert_allclose(values["accel_bias_walk"], 0.00167)
    np.testing.assert_allclose(values["gyro_bias_walk"], 2.91e-5)
    model = kitti.build(values | {"gps_sigma": 0.5})
    np.testing.assert_allclose(model.sensors["gps"].noise_cov, 0.25 * np.eye(3))
    np.testing.assert_array_equal(model.process_functions.params, kitti.model.process_functions.params)


def _held_out_rmse(dataset, estimator):
    result = run(estimator, dataset.model, dataset.log, at=dataset.held_out.t)
    error = dataset.positions(result)[result.index(dataset.held_out.t)] - dataset.held_out.values
    return float(np.sqrt((error**2).sum(axis=1).mean()))


@pytest.mark.parametrize(
    ("estimator", "low", "high"), [(ExtendedKalmanFilter(), 3.7, 3.9), (IteratedSmoother(), 1.05, 1.10)]
)
def test_held_out_error(kitti, estimator, low, high):
    assert low < _held_out_rmse(kitti, estimator) < high


def test_smoothing_more_noise_is_better(kitti):
    """The shipped inertial noise is optimistic: ten times more brings the error from 1.09 to 0.27 m."""
    values = {knob.name: knob.initial for knob in kitti.knobs}
    values |= {name: 10 * values[name] for name in ("accel_density", "gyro_density")}
    result = run(IteratedSmoother(), kitti.build(values), kitti.log, at=kitti.held_out.t)
    error = kitti.positions(result)[result.index(kitti.held_out.t)] - kitti.held_out.values
    assert 0.25 < np.sqrt((error**2).sum(axis=1).mean()) < 0.29


def test_a_missing_folder_is_a_sentence(tmp_path):
    with pytest.raises(Exception, match=r"KittiEquivBiasedImu.txt.*gtsam wheel"):
        load("kitti", data=tmp_path)
