"""Ask before a filter is built: can the sensors show the state, where will it settle, will it be honest.

A drone keeps its height by a barometer that drifts.  To the barometer alone, height and drift are one number;
a sonar that reads now and then tells them apart.
"""

import numpy as np

import sequential as sq
from sequential.evaluate import monte_carlo, observability

# height m and its rate m/s; what the barometer is off, m
STATE = sq.Product(climb=sq.Vector(2), drift=sq.Vector(1))
PROCESS = sq.Independent(climb=sq.ConstantVelocity(0.2), drift=sq.RandomWalk(0.01**2))
PRIOR = sq.Gaussian([10.0, 0.0, 0.0], sq.diagonal([1.0, 0.5, 3.0]))
BAROMETER = sq.LinearSensor([[1.0, 0.0, 1.0]], 0.4**2)
SONAR = sq.LinearSensor([[1.0, 0.0, 0.0]], 0.05**2)
TIMES = np.arange(0.0, 60.0, 0.1)


def drone(**sensors):
    """The same drone with other sensors."""
    return sq.StateSpace(STATE, PRIOR, PROCESS, sensors, start=0.0)


alone, both = drone(barometer=BAROMETER), drone(barometer=BAROMETER, sonar=SONAR)
rng = np.random.default_rng(1)

print("barometer alone")
log = sq.simulate(alone, TIMES, rng).log
seen_alone = observability(alone, log)
print(seen_alone)
try:
    sq.steady_state(alone, 0.1)
except sq.FactorlabError as reason:
    print(f"no steady state: {reason}")

print("\nbarometer and sonar")
log = sq.simulate(both, TIMES, rng, readings={"sonar": 10}).log
seen_both = observability(both, log)
print(seen_both)
settled = sq.steady_state(both, 0.1)
sigmas = np.sqrt(np.diag(settled.cov)).round(3)
print(f"with both at 10 Hz it settles in {settled.settles:.0f} steps to σ = {sigmas}")

honest = monte_carlo(both, sq.KalmanFilter(), TIMES[::5], rng, runs=100, readings={"sonar": 2})
print(honest)
timid = sq.Independent(climb=sq.ConstantVelocity(0.02), drift=sq.RandomWalk(0.01**2))
wrong = sq.StateSpace(STATE, PRIOR, timid, both.sensors, start=0.0)
found = monte_carlo(wrong, sq.KalmanFilter(), TIMES[::5], rng, runs=100, readings={"sonar": 2}, truth=both)
print(f"with a tenth of the process noise: {found}")

assert [one.words.count("drift") for one in seen_alone.unobservable] == [1]
assert seen_both.observable
assert honest.verdict == "consistent"
assert found.verdict == "overconfident"
