"""A target that flies straight and now and then turns hard: two models, and how likely each one is.

A filter tuned to the straights lags in a turn, one tuned to the turns is noisy on the straights.  The
interacting multiple model filter runs both and mixes them as often as the target is known to switch.
"""

import numpy as np

import sequential as sq

READ = sq.LinearSensor([[1.0, 0, 0, 0], [0, 1.0, 0, 0]], [25.0**2, 25.0**2])  # radar plots, m
PRIOR = sq.Gaussian([0.0, 0.0, 120.0, 0.0], sq.diagonal([50.0, 50.0, 20.0, 20.0]))


def target(acceleration_density):
    """The same target, more or less lively."""
    process = sq.ConstantVelocity(acceleration_density, axes=2)
    return sq.StateSpace(sq.Vector(4), PRIOR, process, {"radar": READ}, start=0.0)


cruising, turning = target(0.5), target(400.0)
both = sq.InteractingMultipleModel((cruising, turning), switching_rate=0.05)  # a switch in 20 s or so


def flight(rng, dt=1.0):
    """A truth that is none of the models: straight, a turn of 3 g, straight, a turn back, straight."""
    rate = np.repeat([0.0, 0.25, 0.0, -0.25, 0.0], [60, 6, 60, 6, 60])  # rad/s
    heading = np.cumsum(rate * dt)
    velocity = 120.0 * np.column_stack([np.cos(heading), np.sin(heading)])
    truth = np.cumsum(velocity * dt, axis=0)
    t = np.arange(1, len(truth) + 1) * dt
    return sq.SensorLog({"radar": sq.Stream(t, truth + 25.0 * rng.standard_normal(truth.shape))}), truth, rate


estimators = {
    "cruising alone": (sq.KalmanFilter(), cruising),
    "turning alone": (sq.KalmanFilter(), turning),
    "both, mixed": (both, cruising),
    "both, smoothed": (sq.RauchTungStriebel(both), cruising),
}
rng, errors, chance = np.random.default_rng(7), {name: [] for name in estimators}, []
for _ in range(30):
    log, truth, rate = flight(rng)
    for name, (estimator, model) in estimators.items():
        run = sq.run(estimator, model, log)
        rows = run.index(log["radar"].t)
        errors[name].append(np.sum((run.mean[rows, :2] - truth) ** 2, axis=1))
    chance.append(run.modes.probability[rows, 1])

rms = {name: np.sqrt(np.mean(values)) for name, values in errors.items()}
for name, value in rms.items():
    print(f"{name:15s} {value:6.1f} m")
turns, straights = np.mean(chance, axis=0)[rate != 0], np.mean(chance, axis=0)[rate == 0]
print(f"called a turn: {turns.mean():.0%} of the turns, {straights.mean():.0%} of the straights")

assert rms["both, mixed"] < 0.9 * min(rms["cruising alone"], rms["turning alone"])
assert rms["both, smoothed"] < 0.8 * rms["both, mixed"]
assert turns.mean() > 0.75
assert straights.mean() < 0.25
