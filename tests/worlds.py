"""Worlds: small models with a truth, one of each kind; `EVERY_WORLD` is the family to parametrise over.

A world draws logs of itself (`world.draw(rng)`), so that an estimator's claims can be held against the truth.
"""

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import sequential as sq


@dataclass(frozen=True, eq=False)
class World:
    """A model, the times of its truth, what drives it, and when its sensors read."""

    name: str
    model: sq.StateSpace
    t: np.ndarray
    inputs: np.ndarray | None = None
    readings: Mapping[str, Any] = field(default_factory=dict)
    contexts: Mapping[str, Any] = field(default_factory=dict)
    linear: bool = False

    def __repr__(self):
        return self.name

    def draw(self, rng):
        """One log with its truth."""
        return sq.simulate(
            self.model, self.t, rng, inputs=self.inputs, readings=self.readings, contexts=self.contexts
        )

    def problem(self, rng):
        """One log, laid out; nodes at every reading."""
        drawn = self.draw(rng)
        return sq.prepare(self.model, drawn.log)


def times(count, dt):
    return np.arange(count) * dt


LANDMARKS = np.array([[8.0, 1.0], [-3.0, 7.0], [-4.0, -6.0], [5.0, -7.0]])


def constant_velocity():
    model = sq.StateSpace(
        manifold=sq.Vector(4),
        prior=sq.Gaussian([0.0, 1.0, 1.0, -0.5], [1.0, 1.0, 0.25, 0.25]),
        process=sq.ConstantVelocity(0.1, axes=2),
        sensors={"position": sq.LinearSensor([[1.0, 0, 0, 0], [0, 1.0, 0, 0]], [0.25, 0.5])},
        start=0.0,
    )
    return World("constant velocity", model, times(60, 0.25), linear=True)


def random_walk():
    sensors = {
        "pair": sq.LinearSensor([[1.0, 0.5, 0], [0, 1.0, -1.0]], [[0.3, 0.1], [0.1, 0.2]]),
        "sum": sq.LinearSensor([[1.0, 1.0, 1.0]], 0.4),
    }
    density = [[0.2, 0.05, 0], [0.05, 0.3, 0], [0, 0, 0.1]]
    model = sq.StateSpace(
        sq.Vector(3),
        sq.Gaussian([1.0, 2.0, 3.0], 2.0 * np.eye(3)),
        sq.RandomWalk(density),
        sensors,
        start=0.0,
    )
    return World("random walk", model, times(50, 0.3), readings={"pair": 2, "sum": 3}, linear=True)


def unicycle_range_bearing():
    model = sq.StateSpace(
        manifold=sq.SE2(),
        prior=sq.Gaussian([1.0, -1.0, 0.5], sq.diagonal([0.3, 0.3, 0.1])),
        process=sq.Unicycle(0.02, 0.02, 0.02, slip=0.02, turn_slip=0.02),
        sensors={"landmark": sq.RangeBearing(LANDMARKS, sq.diagonal([0.1, 0.03]))},
        input="odometry",
        start=0.0,
    )
    return World(
        "unicycle, range and bearing", model, times(121, 0.1), drive(121),
        {"landmark": np.arange(4, 121, 4)}, {"landmark": (np.arange(30) % 4)[:, None]},
    )  # fmt: skip


def unicycle_range_bias():
    manifold = sq.Product(pose=sq.SE2(), bias=sq.Vector(1))
    model = sq.StateSpace(
        manifold=manifold,
        prior=sq.Gaussian([0.5, 0.0, -0.4, 0.2], sq.diagonal([0.3, 0.3, 0.1, 0.3])),
        process=sq.Unicycle(0.02, 0.02, 0.02),
        sensors={"range": sq.Range(LANDMARKS, 0.1**2, bias="bias")},
        input="odometry",
        start=0.0,
        static=("bias",),
    )
    return World(
        "unicycle, range with a bias", model, times(121, 0.1), drive(121),
        {"range": np.arange(2, 121, 2)}, {"range": (np.arange(60) % 4)[:, None]},
    )  # fmt: skip


def drive(count):
    """Speed and turn rate of a winding drive."""
    k = np.arange(count)
    return np.column_stack([1.0 + 0.3 * np.sin(0.05 * k), 0.4 * np.cos(0.07 * k)])


def strapdown():
    noise = sq.ImuNoise(gyro_density=2e-3, accel_density=2e-2, gyro_bias_walk=1e-4, accel_bias_walk=1e-3)
    mean = sq.inertial_state().pack(
        nav=[math.cos(0.4), 0, 0, math.sin(0.4), 1.0, 2.0, 0.5, 2.0, 0.0, 0.1],
        accel_bias=[0.05, -0.02, 0.03],
        gyro_bias=[0.01, 0.0, -0.01],
    )
    sigmas = [*[0.03] * 3, *[0.5] * 3, *[0.3] * 3, *[0.05] * 3, *[0.01] * 3]
    sensors = {
        "gps": sq.Position(0.2**2, lever_arm=(0.5, -0.3, 0.8)),
        "compass": sq.Direction((0.4, 0.1, -0.9), 0.02**2),
    }
    model = sq.StateSpace(
        sq.inertial_state(), sq.Gaussian(mean, sq.diagonal(sigmas)), sq.Strapdown(noise), sensors, "imu", 0.0
    )
    k = np.arange(201)
    turning = np.column_stack([0.1 * np.sin(0.05 * k), 0.1 * np.cos(0.04 * k), 0.3 + 0 * k])
    pushing = np.column_stack([0.5 * np.cos(0.03 * k), 0.6 + 0 * k, 9.81 + 0.2 * np.sin(0.06 * k)])
    return World(
        "strapdown", model, times(201, 0.02), np.column_stack([pushing, turning]), {"gps": 10, "compass": 4}
    )


def pendulum_step(x, dt):
    """Damped pendulum, one midpoint step."""
    angle = x[0] + 0.5 * dt * x[1]
    rate = x[1] + 0.5 * dt * (-4.0 * math.sin(x[0]) - 0.1 * x[1])
    return np.array([x[0] + dt * rate, x[1] + dt * (-4.0 * math.sin(angle) - 0.1 * rate)])


def pendulum_tip(x):
    return np.array([math.sin(x[0]), 1.0 - math.cos(x[0])])


def pendulum():
    model = sq.StateSpace(
        manifold=sq.Vector(2),
        prior=sq.Gaussian([0.8, 0.0], [0.05, 0.05]),
        process=sq.Process(pendulum_step, noise_density=[1e-4, 0.01]),
        sensors={"tip": sq.Sensor(pendulum_tip, [0.01, 0.01])},
        start=0.0,
    )
    return World("pendulum of a user", model, times(80, 0.05), readings={"tip": 2})


def gyro_step(x, u, dt):
    """Quaternion turned by a rate in its own axes."""
    a, b, c = u[0] * dt, u[1] * dt, u[2] * dt
    angle = math.sqrt(a * a + b * b + c * c)
    s = 0.5 - angle * angle / 48.0 if angle < 1e-4 else math.sin(0.5 * angle) / angle
    p, q, r, v = math.cos(0.5 * angle), s * a, s * b, s * c
    return np.array(
        [
            x[0] * p - x[1] * q - x[2] * r - x[3] * v,
            x[0] * q + x[1] * p + x[2] * v - x[3] * r,
            x[0] * r - x[1] * v + x[2] * p + x[3] * q,
            x[0] * v + x[1] * r - x[2] * q + x[3] * p,
        ]
    )


def attitude():
    k = np.arange(151)
    model = sq.StateSpace(
        manifold=sq.SO3(),
        prior=sq.Gaussian([1.0, 0, 0, 0], 0.2**2 * np.eye(3)),
        process=sq.Process(gyro_step, noise_density=1e-3, inputs=3),
        sensors={
            "gravity": sq.Direction((0, 0, 9.81), 0.3**2),
            "field": sq.Direction((0.5, 0.0, -0.8), 0.05**2),
        },
        input="gyro",
        start=0.0,
    )
    rates = np.column_stack([np.sin(0.1 * k), 0.7 * np.cos(0.05 * k), 0.5 + 0.0 * k])
    return World("attitude", model, times(151, 0.02), rates, {"gravity": 2, "field": 5})


def floating_pose():
    model = sq.StateSpace(
        manifold=sq.SE3(),
        prior=sq.Gaussian([1.0, 0, 0, 0, 1.0, 2.0, 3.0], sq.diagonal([0.1] * 3 + [0.5] * 3)),
        process=sq.RandomWalk([0.002] * 3 + [0.05] * 3),
        sensors={"antenna": sq.Position(0.1**2, lever_arm=(1.0, 0.5, -0.5)), "mast": sq.Position(0.1**2)},
        start=0.0,
    )
    return World("floating pose", model, times(60, 0.2), readings={"antenna": 2, "mast": 3})


EVERY_WORLD = [
    constant_velocity(),
    random_walk(),
    unicycle_range_bearing(),
    unicycle_range_bias(),
    strapdown(),
    pendulum(),
    attitude(),
    floating_pose(),
]

LINEAR_WORLDS = [world for world in EVERY_WORLD if world.linear]
CURVED_WORLDS = [world for world in EVERY_WORLD if not world.linear]


def nees(run, truth, rows):
    """(K,) normalised estimation error squared of the nodes at the given rows of the truth."""
    error = run.manifold.local(run.mean[rows], truth[rows])
    return np.einsum("ki,kij,kj->k", error, np.linalg.inv(run.cov[rows]), error)


def with_functions(model, change):
    """The same model with every set of lowered functions put through `change`."""
    other = copy.copy(model)
    object.__setattr__(other, "process_functions", change(model.process_functions))
    sensors = {name: change(f) for name, f in model.sensor_functions.items()}
    object.__setattr__(other, "sensor_functions", sensors)
    return other


def without_jacobians(model):
    """The same model, every Jacobian differenced."""
    return with_functions(model, lambda f: replace(f, jacobian=None, advance=None, carry=None))


def without_fusion(model):
    """The same model, covariances pushed by the dense Jacobian."""
    return with_functions(model, lambda f: replace(f, advance=None, carry=None))
