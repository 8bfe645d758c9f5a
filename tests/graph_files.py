"""Small pose graphs with noise, as files and problems."""

import numpy as np

from sequential.manifold import SE2, SE3
from sequential.slam import Factors, SlamProblem
from sequential.slam.models import Between, Prior
from sequential.slam.models.groups import between, compose


def wander(manifold, rng, count=30, turn=0.6):
    """Poses (count, n) of a walk that crosses itself."""
    step = np.zeros((count, manifold.dim))
    if isinstance(manifold, SE2):
        step[:, 0], step[:, 2] = 1.0, turn * rng.standard_normal(count)
    else:
        step[:, 3], step[:, :3] = 1.0, turn * rng.standard_normal((count, 3))
    poses = [manifold.random(rng)]
    for k in range(1, count):
        poses.append(manifold.retract(poses[-1], step[k]))
    return np.stack(poses)


def looped(manifold, rng, count=30, loops=25, sigma=0.05, noise=None):
    """A walk with odometry and loop closures; returns the problem and the true poses."""
    truth = wander(manifold, rng, count)
    d = manifold.dim
    odometry = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    pairs = np.array([rng.choice(count, 2, replace=False) for _ in range(loops)], dtype=np.int64)
    pairs = pairs.reshape(-1, 2)
    pairs = pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 1]
    cov = np.diag(rng.uniform(0.5, 2.0, d)) * sigma**2 if noise is None else noise
    root = np.linalg.cholesky(cov)
    groups = [Factors(Prior(manifold), ("x",), [[0]], truth[:1], 1e-8, name="prior")]
    for name, index in (("odometry", odometry), ("loop", pairs))[: 2 if len(pairs) else 1]:
        exact = between(manifold, truth[index[:, 0]], truth[index[:, 1]])
        z = manifold.retract(exact, (root @ rng.standard_normal((d, len(index)))).T)
        groups.append(Factors(Between(manifold), ("x", "x"), index, z, cov, name=name))
    return SlamProblem({"x": manifold}, tuple(groups)), truth


def moved(manifold, poses, first):
    """Poses in a frame where the first one is `first`."""
    start = manifold.identity()
    back = between(manifold, poses[:1], start[None])
    return compose(manifold, np.tile(first, (len(poses), 1)), compose(manifold, back, poses))


BOTH = [SE2(), SE3()]
