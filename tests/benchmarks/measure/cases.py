"""The cases on which filters are timed: three linear tracks, a unicycle, and many series."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import sequential as sq

DT = 0.1  # s
SPEED, TURN = 1.0, 0.1  # m/s, rad/s
RANGED, SEEN = (2.0, 3.0), (-4.0, 14.0)  # the landmark whose range is read, and the one whose bearing is


@dataclass(frozen=True)
class Linear:
    """x' = F x + w, z = H x + v; every reading follows a prediction.  z is (series, steps, m)."""

    F: np.ndarray
    Q: np.ndarray
    H: np.ndarray
    R: np.ndarray
    x0: np.ndarray
    P0: np.ndarray
    z: np.ndarray

    @property
    def sizes(self) -> tuple[int, int]:
        """State and measurement."""
        return len(self.F), len(self.H)


@dataclass(frozen=True)
class Planar:
    """A unicycle on a circle: known speed and turn rate, range to one landmark, bearing of another."""

    Q: np.ndarray
    R: np.ndarray
    x0: np.ndarray
    P0: np.ndarray
    z: np.ndarray  # (steps, 2)


def track(axes: int, order: int, steps: int, series: int = 1, density: float = 0.5, seed: int = 0) -> Linear:
    """Nearly constant velocity (order 2) or acceleration (3) in some axes, whose positions are read."""
    one, powers = np.eye(axes), np.arange(order)
    up = powers[None, :] - powers[:, None]
    factorial = np.array([math.factorial(k) for k in range(order)])
    F = np.kron(np.where(up >= 0, DT ** np.maximum(up, 0) / factorial[np.maximum(up, 0)], 0.0), one)
    down = order - 1 - powers
    span = down[:, None] + down[None, :] + 1
    Q = density * np.kron(DT**span / (span * np.outer(factorial[down], factorial[down])), one)
    H = np.kron(np.eye(order)[:1], one)
    rng = np.random.default_rng(seed)
    noise, x = np.linalg.cholesky(Q), rng.standard_normal((series, axes * order))
    z = np.empty((series, steps, axes))
    for k in range(steps):
        x = x @ F.T + rng.standard_normal(x.shape) @ noise.T
        z[:, k] = x @ H.T + 0.5 * rng.standard_normal((series, axes))
    return Linear(F, Q, H, 0.25 * one, np.zeros(len(F)), 10.0 * np.eye(len(F)), z)


def step(x, dt):
    """Along a circle."""
    return x[0] + SPEED * dt * math.cos(x[2]), x[1] + SPEED * dt * math.sin(x[2]), x[2] + TURN * dt


def step_jacobian(x, dt):
    """Its derivative."""
    c, s = SPEED * dt * math.cos(x[2]), SPEED * dt * math.sin(x[2])
    return (1.0, 0.0, -s), (0.0, 1.0, c), (0.0, 0.0, 1.0)


def observe(x):
    """Range and bearing."""
    dx, dy = RANGED[0] - x[0], RANGED[1] - x[1]
    return math.sqrt(dx * dx + dy * dy), math.atan2(SEEN[1] - x[1], SEEN[0] - x[0]) - x[2]


def observe_jacobian(x):
    """Its derivative."""
    dx, dy, ex, ey = RANGED[0] - x[0], RANGED[1] - x[1], SEEN[0] - x[0], SEEN[1] - x[1]
    r, square = math.sqrt(dx * dx + dy * dy), ex * ex + ey * ey
    return (-dx / r, -dy / r, 0.0), (ey / square, -ex / square, -1.0)


def circle(steps: int, seed: int = 1) -> Planar:
    """The unicycle's readings, with the noise that the model declares."""
    Q, R = np.diag([1e-4, 1e-4, 1e-5]), np.diag([0.01, 1e-3])
    rng = np.random.default_rng(seed)
    x, z = np.zeros(3), np.empty((steps, 2))
    for k in range(steps):
        x = np.array(step(x, DT)) + rng.standard_normal(3) * np.sqrt(np.diag(Q))
        z[k] = np.array(observe(x)) + rng.standard_normal(2) * np.sqrt(np.diag(R))
    z[:, 1] = np.arctan2(np.sin(z[:, 1]), np.cos(z[:, 1]))
    return Planar(Q, R, np.array([0.1, -0.1, 0.05]), np.diag([0.1, 0.1, 0.01]), z)


def stamps(steps: int) -> np.ndarray:
    """(steps,) ns; the first reading comes one step after the prior at zero."""
    return (np.arange(1, steps + 1) * round(DT * 1e9)).astype(np.int64)


def unicycle_problem(case: Planar) -> sq.Problem:
    """The unicycle as a user declares it, with Jacobians, laid out on its log."""
    density = case.Q / DT
    process = sq.Process(step, noise_density=density, jacobian=step_jacobian)
    sight = sq.Product(range=sq.Vector(1), bearing=sq.SO2())
    sensor = sq.Sensor(observe, case.R, jacobian=observe_jacobian, manifold=sight)
    model = sq.StateSpace(sq.Vector(3), sq.Gaussian(case.x0, case.P0), process, {"sight": sensor}, start=0)
    return sq.prepare(model, sq.SensorLog({"sight": sq.Stream(stamps(len(case.z)), case.z)}))
