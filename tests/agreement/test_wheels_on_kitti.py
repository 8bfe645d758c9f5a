"""What wheels cannot do helps on a real car: KITTI with the constraint across and up, no encoder at all."""

import numpy as np

import sequential as sq
from factorlab.datasets import load


def held_out_error(kitti, model, log, estimator):
    """RMSE at the fixes that nobody was given, m; and the run."""
    run = sq.run(estimator, model, log, at=kitti.held_out.t)
    off = kitti.positions(run)[run.index(kitti.held_out.t)] - kitti.held_out.values
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1)))), run


def test_the_constraint_across_helps_on_kitti():
    kitti = load("kitti")[0]
    plain = kitti.model
    t = kitti.log["imu"].t[::50]
    log = kitti.log.replaced(wheels=sq.Stream(t, np.zeros((len(t), 2))))
    wheels = sq.BodyVelocity([0.3**2, 0.3**2], axes=(1, 2))
    sensors = {**plain.sensors, "wheels": wheels}
    model = sq.StateSpace(plain.manifold, plain.prior, plain.process, sensors, plain.input, plain.start)
    before, _ = held_out_error(kitti, plain, kitti.log, sq.ExtendedKalmanFilter())
    after, run = held_out_error(kitti, model, log, sq.ExtendedKalmanFilter())
    assert 3.5 < before < 4.2
    assert after < 0.85 * before  # 3.11 of 3.84 m
    both, smoother = ((plain, kitti.log), (model, log)), sq.IteratedSmoother()
    smoothed = [held_out_error(kitti, *given, smoother)[0] for given in both]
    assert smoothed[1] < 1.02 * smoothed[0]  # 1.06 of 1.09 m
    across = run.innovations["wheels"].residual
    assert np.abs(np.nanmedian(across, axis=0)).max() < 0.1
