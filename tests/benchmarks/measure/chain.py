"""A user-written range sensor, which has no native factor, on a long chain of planar poses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import sequential as sq
from sequential.log import seconds
from sequential.model import evaluate
from sequential.timeline import Problem

BEACONS = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 60.0], [0.0, 60.0]])
PLACES = BEACONS.ravel().copy()
SIGMA = 0.3  # m
DT = 0.1  # s


def observe(x: np.ndarray, context: np.ndarray) -> np.ndarray:
    """Distance to a beacon, as a user would write it."""
    i = int(context[0])
    return np.array([math.hypot(PLACES[2 * i] - x[0], PLACES[2 * i + 1] - x[1])])


def observe_jacobian(x: np.ndarray, context: np.ndarray) -> np.ndarray:
    """Its derivative along steps in the body frame, for users who write that too."""
    i = int(context[0])
    dx, dy = PLACES[2 * i] - x[0], PLACES[2 * i + 1] - x[1]
    c, s, r = math.cos(x[2]), math.sin(x[2]), math.hypot(dx, dy)
    return np.array([-(c * dx + s * dy) / r, -(c * dy - s * dx) / r, 0.0])


@dataclass(frozen=True)
class Chain:
    """The same problem with the built-in sensor, and with the user's, without and with its Jacobian."""

    native: Problem
    user: Problem
    user_jacobian: Problem
    truth: np.ndarray


def make(nodes: int, rng: np.random.Generator) -> Chain:
    """Simulate a wandering vehicle that measures one beacon at each pose."""
    t = (np.arange(nodes) * round(DT * 1e9)).astype(np.int64)
    when = seconds(t)
    u = np.column_stack([1.0 + 0.3 * np.sin(0.1 * when), 0.05 + 0.12 * np.cos(0.5 * when)])
    process, space = sq.Unicycle(along=0.05, across=0.02, heading=0.02), sq.SE2()
    prior = sq.Gaussian([30.0, 20.0, 0.0], np.array([0.1, 0.1, 0.05]) ** 2)
    which = np.arange(nodes) % len(BEACONS)
    truth = drive(process, space, u, np.array(prior.mean), nodes, rng)
    z = np.hypot(*(BEACONS[which] - truth[:, :2]).T) + SIGMA * rng.standard_normal(nodes)
    log = sq.SensorLog({"odometry": sq.Stream(t, u), "range": sq.Stream(t, z, context=which)})
    sensors = (
        sq.Range(BEACONS, SIGMA**2),
        sq.Sensor(observe, SIGMA**2, context=1),
        sq.Sensor(observe, SIGMA**2, jacobian=observe_jacobian, context=1),
    )
    models = (sq.StateSpace(space, prior, process, {"range": s}, "odometry") for s in sensors)
    return Chain(*(sq.prepare(model, log) for model in models), truth)


def drive(
    process: sq.Unicycle, space: sq.SE2, u: np.ndarray, x: np.ndarray, nodes: int, rng: np.random.Generator
) -> np.ndarray:
    """True poses (N, 3), with the process noise that the model declares."""
    f = process.functions(space)
    poses = [x]
    for k in range(1, nodes):
        x = evaluate(f.value, poses[-1], u[k - 1], DT, f.params, 3)
        assert f.noise is not None
        cov = evaluate(f.noise, poses[-1], u[k - 1], DT, f.params, 9).reshape(3, 3)
        poses.append(space.retract(x, np.linalg.cholesky(cov) @ rng.standard_normal(3)))
    return np.array(poses)
