"""Simulated worlds for SLAM: a planar robot that goes in loops among landmarks."""

from dataclasses import dataclass

import numpy as np

from sequential.manifold import SE2, Vector
from sequential.slam import Factors, SlamProblem
from sequential.slam.models import Between, LandmarkRangeBearing, Prior
from sequential.slam.models.groups import between, compose

SIGMA_START = np.array([0.02, 0.02, 0.01])


@dataclass(frozen=True)
class LoopWorld:
    """The truth, and the problem that is made of what the robot measured."""

    poses: np.ndarray  # (K, 3)
    landmarks: np.ndarray  # (L, 2)
    problem: SlamProblem
    ids: np.ndarray  # (N,) which landmark each sighting was of


def loops(
    rng,
    *,
    steps=120,
    turns=3.8,
    landmarks=20,
    radius=6.0,
    reach=5.0,
    scale=1.0,
    sigma_odometry=(0.05, 0.03, 0.03),
    sigma_sighting=(0.15, 0.03),
    unknown=False,
    every=1,
):
    """A robot on a circle; the measured values are drawn with exactly the declared noise."""
    se2 = SE2()
    odometry, sighting = scale * np.array(sigma_odometry), scale * np.array(sigma_sighting)
    angle = 2 * np.pi * turns / (steps - 1) * np.arange(steps)
    poses = np.stack([radius * np.sin(angle), -radius * np.cos(angle), angle], axis=1)
    poses = se2.normalize(poses)
    around = rng.uniform(0, 2 * np.pi, landmarks)
    distance = radius + rng.uniform(-0.6 * reach, 0.6 * reach, landmarks)
    places = distance[:, None] * np.stack([np.cos(around), np.sin(around)], axis=1)
    first = se2.retract(poses[:1], SIGMA_START * rng.standard_normal((1, 3)))
    moves = se2.retract(between(se2, poses[:-1], poses[1:]), odometry * rng.standard_normal((steps - 1, 3)))
    model, index, z = LandmarkRangeBearing(), [], []
    for k in range(0, steps, every):
        seen = model.expected(np.tile(poses[k], (landmarks, 1)), places)
        for j in np.flatnonzero(seen[:, 0] < reach):
            index.append((k, j))
            z.append(model.measured.retract(seen[j], sighting * rng.standard_normal(2)))
    index = np.array(index)
    rows, hidden = np.arange(steps - 1), 1 if unknown else None
    factors = (
        Factors(Prior(se2), ("x",), np.zeros((1, 1)), first, SIGMA_START**2, name="start"),
        Factors(Between(se2), ("x", "x"), np.stack([rows, rows + 1], 1), moves, odometry**2, name="odometry"),
        Factors(
            model,
            ("x", "l"),
            index,
            np.array(z),
            sighting**2,
            name="sighting",
            unknown=hidden,
        ),
    )
    problem = SlamProblem({"x": se2, "l": Vector(2)}, factors)
    return LoopWorld(poses, places, problem, index[:, 1])


def last_nees(run, world):
    """NEES of the last pose."""
    error = SE2().local(run.values.rows["x"][-1], world.poses[-1])
    return float(error @ np.linalg.solve(run.covs["x"][-1], error))


def carried(poses, motion):
    """Every pose moved as a part of the world: motion ∘ pose."""
    return compose(SE2(), np.broadcast_to(motion, poses.shape), poses)
