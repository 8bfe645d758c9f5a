"""Problems of several kinds of variables with known truth: a loop among landmarks, and pose graphs."""

import numpy as np

from sequential.manifold import SE2, Vector
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import Between, Displacement, LandmarkRangeBearing, Prior
from sequential.slam.models.groups import between

ODOMETRY = np.diag([0.02, 0.01, 0.01]) ** 2
SIGHTING = np.diag([0.1, 0.02]) ** 2
FIRST = np.diag([1e-3, 1e-3, 1e-3]) ** 2


def loop(rng, steps=60, landmarks=12, turns=2.0, *, model=None, noise=1.0, loss=None):
    """A robot that drives in circles among landmarks: the problem, true poses and true landmarks."""
    model = model or LandmarkRangeBearing()
    turn = 2.0 * np.pi * turns / steps
    pose = [np.array([5.0, 0.0, np.pi / 2])]
    for _ in range(steps):
        pose.append(SE2().retract(pose[-1], np.array([5.0 * turn, 0.0, turn])))
    pose = np.array(pose)
    angle = 2.0 * np.pi * np.arange(landmarks) / landmarks
    place = (
        np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        * np.where(np.arange(landmarks) % 2, 3.0, 7.0)[:, None]
    )
    far = np.linalg.norm(pose[:, None, :2] - place, axis=-1)
    seen = np.argwhere(far < 4.0)
    moved = SE2().retract(
        between(SE2(), pose[:-1], pose[1:]), noise * rng.standard_normal((steps, 3)) @ np.sqrt(ODOMETRY)
    )
    z = model.expected(pose[seen[:, 0]], place[seen[:, 1]])
    z = model.measured.retract(z, noise * rng.standard_normal((len(z), 2)) @ np.sqrt(SIGHTING))
    first = SE2().retract(pose[0], rng.standard_normal(3) @ np.sqrt(FIRST))
    steps_of = np.arange(steps)
    factors = (
        Factors(Prior(SE2()), ("x",), [[0]], first[None], FIRST, name="first pose"),
        Factors(
            Between(SE2()),
            ("x", "x"),
            np.stack([steps_of, steps_of + 1], 1),
            moved,
            ODOMETRY,
            name="odometry",
        ),
        Factors(model, ("x", "l"), seen, z, SIGHTING, loss, name="sightings"),
    )
    return SlamProblem({"x": SE2(), "l": Vector(2)}, factors), pose, place


def displaced(rng, **settings):
    """The same loop with displacements, which GTSAM has no factor for."""
    return loop(rng, model=Displacement(), **settings)


def pose_graph(rng, manifold, count=40, closures=25):
    """A random walk of poses with loop closures: the problem and the true poses."""
    d = manifold.dim
    pose = [manifold.identity()]
    for _ in range(count - 1):
        pose.append(manifold.retract(pose[-1], 0.5 * rng.standard_normal(d)))
    pose = np.array(pose)
    ends = np.sort(rng.choice(count, (closures, 2)), axis=1)
    ends = ends[ends[:, 1] - ends[:, 0] > 1]
    chain = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    cov = np.diag(rng.uniform(0.5, 2.0, d)) * 0.02**2

    def read(pairs):
        exact = between(manifold, pose[pairs[:, 0]], pose[pairs[:, 1]])
        return manifold.retract(exact, rng.standard_normal((len(pairs), d)) @ np.sqrt(cov))

    factors = (
        Factors(Prior(manifold), ("x",), [[0]], pose[:1], 1e-6, name="first pose"),
        Factors(Between(manifold), ("x", "x"), chain, read(chain), cov, name="odometry"),
        Factors(Between(manifold), ("x", "x"), ends, read(ends), cov, name="loop closures"),
    )
    return SlamProblem({"x": manifold}, factors), pose


def spread(problem, values, rng, sigma):
    """Values moved at random."""
    return Values(
        dict(values.index),
        {
            kind: problem.kinds[kind].retract(
                rows, sigma * rng.standard_normal((len(rows), problem.kinds[kind].dim))
            )
            for kind, rows in values.rows.items()
        },
    )
