"""Two beacons cannot tell left from right: a belief with two peaks, and the filter that can hold it.

A walker hears the distance to two beacons on a line, and later to a third one.  Until then it may be on
either side.  A Gaussian has one peak, so the extended filter picks none of the two; particles keep both.
"""

import numpy as np

import sequential as sq

BEACONS = [[-5.0, 0.0], [5.0, 0.0], [0.0, 8.0]]
ONLY_TWO = 24  # readings before the third beacon is heard

model = sq.StateSpace(
    sq.Vector(2),
    sq.Gaussian([0.0, 0.0], sq.diagonal([4.0, 4.0])),
    sq.RandomWalk(0.02),
    {"range": sq.Range(BEACONS, 0.2**2)},
    start=0.0,
)
count, rng = 60, np.random.default_rng(3)
path = np.array([2.0, 4.0]) + np.cumsum(0.1 * rng.standard_normal((count, 2)), axis=0)
heard = np.where(np.arange(count) < ONLY_TWO, np.arange(count) % 2, np.arange(count) % 3)
distance = np.linalg.norm(path - np.array(BEACONS)[heard], axis=1) + 0.2 * rng.standard_normal(count)
log = sq.SensorLog({"range": sq.Stream(np.arange(count) * 0.5, distance, heard)})

particles = sq.ParticleFilter(4000, np.random.default_rng(0), keep=True)
run, ekf = sq.run(particles, model, log), sq.run(sq.ExtendedKalmanFilter(), model, log)

states, weights = run.particles.states, run.particles.weights
above = np.sum(weights * (states[:, :, 1] > 0.0), axis=1)
for k in (0, 12, ONLY_TWO - 1, ONLY_TWO + 6, count - 1):
    print(
        f"reading {k:2d}: above the line with {above[k]:4.0%}, effective particles "
        f"{run.particles.effective[k]:5.0f}, y = {run.mean[k, 1]:5.2f} ± {run.sigmas()[k, 1]:.2f}"
    )
last = ONLY_TWO - 1
at, sigma = ekf.mean[last, 1], ekf.sigmas()[last, 1]
print(f"EKF, reading {last}: y = {at:.2f} ± {sigma:.2f}, truth {path[last, 1]:.2f}")

assert 0.2 < above[12] < 0.8
assert above[-1] > 0.99
assert np.linalg.norm(run.mean[-1] - path[-1]) < 0.5
assert abs(ekf.mean[last, 1]) < 1e-9  # it has not moved from the line at all
