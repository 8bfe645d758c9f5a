"""One declaration in a filter, a smoother and a factor graph, on a real drive."""

import numpy as np

import sequential as sq
from factorlab.datasets import load
from factorlab.graph import BatchGraph

(kitti,) = load("kitti", use_every=5)  # one GPS fix in five is used, the other four judge
noise = sq.ImuNoise(gyro_density=5e-3, accel_density=0.08, gyro_bias_walk=1e-5, accel_bias_walk=5e-4)
process, sensors = sq.Strapdown(noise, gravity=(0.0, 0.0, -9.8)), {"gps": sq.Position(0.1**2)}
model = sq.StateSpace(sq.inertial_state(), kitti.model.prior, process, sensors, "imu", kitti.model.start)
rmse_m = {}
for estimator in (sq.ExtendedKalmanFilter(), sq.IteratedSmoother(), BatchGraph()):
    run = sq.run(estimator, model, kitti.log, at=kitti.held_out.t)
    error_m = kitti.positions(run)[run.index(kitti.held_out.t)] - kitti.held_out.values
    rmse_m[estimator.name] = np.sqrt(np.mean(np.sum(error_m**2, axis=1)))
    print(f"{estimator.name:6}{rmse_m[estimator.name]:.3f} m off on fixes that it has not seen")
assert rmse_m["batch"] < 0.2 * rmse_m["ekf"]  # what comes later is worth a factor of five
