"""Trajectories in the TUM format, which evo reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from factorlab.datasets import Dataset
from sequential import readers
from sequential.evaluate import Trajectory
from sequential.history import Run
from sequential.manifold import SE2, SE3, Manifold, NavState, Product

__all__ = ["trajectory_of", "write_tum"]


def trajectory_of(dataset: Dataset, run: Run) -> Trajectory:
    """Poses of a run; a planar pose has z = 0, a state without a heading no rotation."""
    position = dataset.positions(run)
    storage, member = _oriented(run.manifold)
    if isinstance(member, NavState | SE3):
        return Trajectory(run.t, position, run.mean[:, storage : storage + 4])
    if isinstance(member, SE2):
        return Trajectory.planar(run.t, position, run.mean[:, storage + 2])
    return Trajectory(run.t, position)


def _oriented(manifold: Manifold) -> tuple[int, Manifold | None]:
    """Storage start and manifold of the first part that has an orientation."""
    if not isinstance(manifold, Product):
        return 0, manifold
    for name, member in manifold.parts.items():
        if isinstance(member, NavState | SE3 | SE2):
            return manifold.storage(name).start, member
    return 0, None


def write_tum(path: Path, dataset: Dataset, run: Run) -> None:
    """Write one trajectory: seconds, position, quaternion with the scalar last."""
    trajectory = trajectory_of(dataset, run)
    finite = np.isfinite(trajectory.position).all(axis=1)
    readers.write_tum(path, trajectory.select(np.flatnonzero(finite)))
