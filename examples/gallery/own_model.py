"""Your own model and your own log: a cargo bike whose wheel sensor reads a few per cent wrong.

Nothing here is built in: the motion (a bicycle with a steering angle) and both sensors are plain functions
without Jacobians.  Run as a script it rides the bike, estimates it three ways and checks the outcome; with
two file names it leaves the recording for the command line:

    python own_model.py ride.csv truth.tum
    factorlab compare ride.csv --model own_model.py:MODEL --truth truth.tum
"""

import math
import sys

import numpy as np

import sequential as sq
from sequential.evaluate import Trajectory
from sequential.readers import write_log, write_tum

WHEELBASE_M = 1.9
LAMPS = np.array([[0.0, 0.0], [40.0, 5.0], [35.0, 45.0], [-5.0, 38.0]])  # lamp posts with radio tags, m
STATE = sq.Product(pose=sq.SE2(), speed=sq.Vector(1), wheel_scale=sq.Vector(1))


def ride(x, u, dt):
    """Bicycle: u = (acceleration along the frame m/s², steering angle rad); the scale of the wheel stays."""
    speed = x[3] + u[0] * dt
    turn = speed / WHEELBASE_M * math.tan(u[1]) * dt
    middle = x[2] + 0.5 * turn
    return np.array(
        [
            x[0] + speed * dt * math.cos(middle),
            x[1] + speed * dt * math.sin(middle),
            math.atan2(math.sin(x[2] + turn), math.cos(x[2] + turn)),
            speed,
            x[4],
        ]
    )


def lamp_distance(x, lamp):
    """Distance to the lamp post whose number stands in the reading's context, m."""
    k = int(lamp[0])
    return math.hypot(LAMPS[k, 0] - x[0], LAMPS[k, 1] - x[1])


def wheel_speed(x):
    """The wheel sensor multiplies the speed by an unknown factor."""
    return x[3] * x[4]


# along, across, heading, speed, scale: variances for each second
NOISE = np.array([0.03, 0.03, 0.01, 0.15, 0.0]) ** 2
START = np.array([18.0, 2.0, 0.2, 4.0, 1.0])
MODEL = sq.StateSpace(
    manifold=STATE,
    prior=sq.Gaussian(START, np.array([1.0, 1.0, 0.2, 0.5, 0.1]) ** 2),
    process=sq.Process(step=ride, noise_density=NOISE, inputs=2),
    sensors={
        "lamps": sq.Sensor(observe=lamp_distance, noise_cov=0.3**2, context=1),
        "wheel": sq.Sensor(observe=wheel_speed, noise_cov=0.1**2),
    },
    input="controls",
    static=("wheel_scale",),
)


def record(rng, duration_s=60.0, rate_hz=20.0):
    """Ride in a loop: the log, and where the bike really was."""
    dt, count = 1.0 / rate_hz, int(duration_s * rate_hz)
    t = np.arange(count + 1) * dt
    x = STATE.retract(START, rng.normal(size=5) * np.sqrt(np.diag(MODEL.prior.cov)))
    controls = np.column_stack([0.3 * np.sin(0.4 * t), 0.14 + 0.08 * np.sin(0.2 * t)])
    states = [x]
    for u in controls[:-1]:
        noise = rng.normal(size=5) * np.sqrt(NOISE * dt)
        states.append(STATE.retract(ride(states[-1], u, dt), noise))
    states = np.array(states)
    heard = np.arange(1, count + 1, 4)
    lamp = rng.integers(0, len(LAMPS), size=(len(heard), 1)).astype(float)
    distance = [lamp_distance(states[k], one) for k, one in zip(heard, lamp, strict=True)]
    speed = [wheel_speed(x) for x in states[1:]]
    log = sq.SensorLog(
        {
            "controls": sq.Stream(t, controls),
            "lamps": sq.Stream(t[heard], distance + 0.3 * rng.normal(size=len(heard)), lamp),
            "wheel": sq.Stream(t[1:], speed + 0.1 * rng.normal(size=count)),
        },
        "ride",
    )
    return log, states, Trajectory.planar(t, states[:, :2], states[:, 2])


def main():
    from factorlab.graph import BatchGraph

    log, states, truth = record(np.random.default_rng(5))
    if len(sys.argv) == 3:
        write_log(sys.argv[1], log)
        write_tum(sys.argv[2], truth)
    rmse = {}
    for estimator in (sq.ExtendedKalmanFilter(), sq.IteratedSmoother(), BatchGraph()):
        run = sq.run(estimator, MODEL, log)
        error = run.mean[:, :2] - states[np.searchsorted(truth.t, run.t), :2]
        rmse[estimator.name] = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
        scale, sigma = run.part("wheel_scale")[-1, 0], run.sigmas()[-1, 4]
        print(f"{estimator.name:6} RMSE {rmse[estimator.name]:.3f} m, wheel scale {scale:.4f} ± {sigma:.4f}")
        assert abs(scale - states[-1, 4]) < 4 * sigma
    assert rmse["ieks"] < 0.8 * rmse["ekf"], "a smoother sees the readings to come"
    assert abs(rmse["ieks"] - rmse["batch"]) < 1e-3 * rmse["batch"], "two ways to one solution"


if __name__ == "__main__":
    main()
