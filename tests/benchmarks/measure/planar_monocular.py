"""One camera on a robot that stays on the floor: where the batch ends, and where a filter goes wrong.

The recorded pixels are all but exact; the same first steps with a noise of one pixel show what a filter does
with measurements that are no better than its linearisation.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from factorlab.datasets.planar_monocular import FOLDER, load_planar_monocular
from factorlab.datasets.slam import SlamDataset
from factorlab.graph.slam import BatchSlam
from measure.figures import Figure, say
from sequential.manifold import SE2
from sequential.slam import EkfSlam, Values
from sequential.slam.beginnings import placed

__all__ = ["figures"]

STEPS, QUICK_STEPS = 30, 15


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "../shared/data")) / FOLDER
    if not (folder / "camera.dat").is_file():
        say(f"planar monocular: needs {folder}, which FACTORLAB_DATA names; left out")
        return {}
    rows = {} if quick else whole(folder)
    for name, noise in (("recorded", 0.0), ("one_pixel", 1.0)):
        (tour,) = load_planar_monocular(folder, pixel_noise=noise, steps=QUICK_STEPS if quick else STEPS)
        rows |= filter_beside_batch(name, tour)
    return rows


def whole(folder: Path) -> dict[str, Figure]:
    """The whole tour by a batch, against the truth; nothing is aligned."""
    (tour,) = load_planar_monocular(folder)
    run = BatchSlam("incremental", covariance=False).solve(tour.problem)
    pixels = tour.problem.factors[2]
    odometry = placed_poses(tour)
    said = f"336 poses, {len(pixels)} pixels; odometry alone {rmse(tour, odometry):.2f} m"
    off = map_errors(tour, run.values)
    on_map = 1e3 * float(np.sqrt(np.mean(off**2)))
    path = 1e3 * rmse(tour, run.values.rows["x"])
    return {
        "planar_monocular_rmse": Figure(path, "mm", said, must=50.0, aim=10.0),
        "planar_monocular_map_rmse": Figure(on_map, "mm", f"{len(off)} points, begun by parallax", must=50.0),
    }


def filter_beside_batch(name: str, tour: SlamDataset) -> dict[str, Figure]:
    """RMSE and normalised error of EKF-SLAM over those of the batch."""
    batch = BatchSlam("incremental", covariance=("x",)).solve(tour.problem)
    ekf = EkfSlam().solve(tour.problem)
    assert ekf.online is not None
    own = rmse(tour, batch.values.rows["x"]), anees(tour, batch.values.rows["x"], batch.covs["x"])
    other = rmse(tour, ekf.online.mean), anees(tour, ekf.online.mean, ekf.online.cov)
    said = f"first {len(ekf.online)} steps: EKF-SLAM {other[0]:.4f} m, batch {own[0]:.4f} m"
    normalised = f"1 expected; batch {own[1]:.2g}"
    return {
        f"planar_monocular_ekf_over_batch_{name}": Figure(other[0] / own[0], "x RMSE", said),
        f"planar_monocular_ekf_anees_{name}": Figure(other[1], "of 3 dof", normalised),
    }


def placed_poses(tour: SlamDataset) -> np.ndarray:
    """Dead reckoning (K, 3)."""
    from dataclasses import replace

    return placed(replace(tour.problem, factors=tour.problem.factors[:2])).rows["x"]


def true_poses(tour: SlamDataset) -> np.ndarray:
    """(K, 3)."""
    assert tour.truth is not None
    assert tour.truth.heading is not None
    return np.column_stack([tour.truth.position, tour.truth.heading])


def rmse(tour: SlamDataset, poses: np.ndarray) -> float:
    """Of positions, m."""
    return float(np.sqrt(np.mean(np.sum((poses - true_poses(tour))[:, :2] ** 2, axis=1))))


def anees(tour: SlamDataset, poses: np.ndarray, covs: np.ndarray) -> float:
    """Mean normalised error over its freedom; the first pose is known."""
    error = SE2().local(poses, true_poses(tour))[1:]
    weighed = np.linalg.solve(covs[1:], error[..., None])[..., 0]
    return float(np.einsum("ni,ni->n", error, weighed).mean() / 3.0)


def map_errors(tour: SlamDataset, values: Values) -> np.ndarray:
    """(L,) distances of points from their true places, m."""
    true = np.stack([tour.landmarks[i] for i in values.index["l"].tolist()])
    return np.linalg.norm(values.rows["l"] - true, axis=1)
