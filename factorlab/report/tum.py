"""Trajectories in the TUM format: seconds, position, quaternion with the scalar last; evo reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets import Dataset
from sequential.history import Run
from sequential.manifold import SE2, SE3, Manifold, NavState, Product

__all__ = ["tum_rows", "write_tum"]

Array = NDArray[np.float64]


def tum_rows(dataset: Dataset, run: Run) -> Array:
    """(N, 7) x y z qx qy qz qw; a planar pose has z = 0, a state without a heading the identity rotation."""
    position = dataset.positions(run)
    out = np.zeros((len(run), 7))
    out[:, : position.shape[1]] = position
    storage, member = _oriented(run.manifold)
    if isinstance(member, NavState | SE3):
        w_first = run.mean[:, storage : storage + 4]
        out[:, 3:6], out[:, 6] = w_first[:, 1:], w_first[:, 0]
    elif isinstance(member, SE2):
        half = run.mean[:, storage + 2] / 2
        out[:, 5], out[:, 6] = np.sin(half), np.cos(half)
    else:
        out[:, 6] = 1.0
    return out


def _oriented(manifold: Manifold) -> tuple[int, Manifold | None]:
    """Storage start and manifold of the first part that has an orientation."""
    if not isinstance(manifold, Product):
        return 0, manifold
    for name, member in manifold.parts.items():
        if isinstance(member, NavState | SE3 | SE2):
            return manifold.storage(name).start, member
    return 0, None


def write_tum(path: Path, dataset: Dataset, run: Run) -> None:
    """Write one trajectory; stamps keep all their nanoseconds, as text of an integer."""
    rows = tum_rows(dataset, run)
    with path.open("w", encoding="ascii") as file:
        file.write("# timestamp tx ty tz qx qy qz qw\n")
        for t, row in zip(run.t.tolist(), rows.tolist(), strict=True):
            sign, whole = ("-" if t < 0 else ""), abs(t)
            stamp = f"{sign}{whole // 10**9}.{whole % 10**9:09d}"
            file.write(f"{stamp} {' '.join(f'{v:.9g}' for v in row)}\n")
