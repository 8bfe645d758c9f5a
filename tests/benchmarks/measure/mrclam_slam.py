"""MRCLAM 7 without its map, both robots by one setting, the first pose known and nothing aligned.

The reference: batch L2 0.825 / 0.469 m with ANEES/3 of 3.0 / 3.2, EKF 1.698 / 0.523 m with 48 / 7.3.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from measure.figures import Figure, say

__all__ = ["figures"]

MUST, AIM = {1: 0.85, 2: 0.48}, {1: 0.6, 2: 0.4}
REFERENCE = {
    1: "gtsam batch 0.825 m, ANEES/3 3.0; EKF 1.698 m, 48",
    2: "gtsam batch 0.469 m, ANEES/3 3.2; EKF 0.523 m, 7.3",
}
HONEST = 2.0
GROUP_M = 0.3  # posts nearer than this stand in one group


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Batch, both filters, and how many sightings find their post without its barcode."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "../shared/data")) / "robot" / "mrclam7"
    if not (folder / "Landmark_Groundtruth.dat").is_file():
        say(f"mrclam_slam: needs {folder}, which FACTORLAB_DATA names; left out")
        return {}
    rows: dict[str, Figure] = {}
    for robot in (2,) if quick else (1, 2):
        rows |= of_robot(folder, robot)
        rows |= hidden(folder, robot)
    return rows


def of_robot(folder: Path, robot: int) -> dict[str, Figure]:
    """RMSE and ANEES of one robot."""
    from factorlab.datasets.mrclam_slam import load_mrclam_slam
    from factorlab.graph.slam import BatchSlam
    from sequential.model import Loss
    from sequential.slam import EkfSlam

    (one,) = load_mrclam_slam(folder, robot)
    filtered = {name: EkfSlam(name).solve(one.problem) for name in ("standard", "invariant")}
    start = filtered["invariant"].values
    runs = filtered | {
        "batch": BatchSlam(initial=start).solve(one.problem),
        "cauchy": BatchSlam(initial=start, loss=Loss("cauchy", 2.385)).solve(one.problem),
    }
    found = {name: judged(one, run) for name, run in runs.items()}
    told = ", ".join(f"{name} {rmse:.3f} m ({honesty:.2f})" for name, (rmse, honesty) in found.items())
    say(f"mrclam robot {robot}: {told}")
    rmse, honesty = found["batch"]
    tag, said = f"mrclam_slam_robot{robot}", REFERENCE[robot]
    rows = {
        f"{tag}_batch_rmse_m": Figure(rmse, "m", said, MUST[robot], AIM[robot]),
        f"{tag}_batch_anees_per_dof": Figure(honesty, "per dof", said, None, HONEST),
    }
    for name, (rmse, honesty) in found.items():
        if name != "batch":
            rows[f"{tag}_{name}_rmse_m"] = Figure(rmse, "m", said)
            rows[f"{tag}_{name}_anees_per_dof"] = Figure(honesty, "per dof", said)
    return rows


def hidden(folder: Path, robot: int) -> dict[str, Figure]:
    """Barcodes withheld: sightings that find their post, and those that find its group."""
    from scipy.sparse.csgraph import connected_components

    from factorlab.datasets import load
    from factorlab.datasets.mrclam_slam import load_mrclam_slam
    from sequential.slam import EkfSlam

    (known,), (one,) = load_mrclam_slam(folder, robot), load_mrclam_slam(folder, robot, hidden=True)
    ids = np.asarray(known.problem.factors[-1].index)[:, 1]
    found = EkfSlam("invariant").solve(one.problem).associations
    posts = np.asarray(load("mrclam", data=folder, robot=robot)[0].model.sensors["sighting"].landmarks)
    near = np.linalg.norm(posts[:, None] - posts[None], axis=2) < GROUP_M
    group = connected_components(near)[1]
    said = f"barcodes withheld, {len(ids)} sightings; posts stand in groups, 18 cm apart"
    return {
        f"mrclam_slam_robot{robot}_right_post": Figure(right(found, ids), "share", said, better="higher"),
        f"mrclam_slam_robot{robot}_right_group": Figure(
            right(found, group[ids]), "share", said, better="higher"
        ),
    }


def right(found: np.ndarray, ids: np.ndarray) -> float:
    """Share of sightings that are of what most sightings of their landmark are of."""
    good = sum(int(np.bincount(ids[found == one]).max()) for one in np.unique(found[found >= 0]))
    return good / len(ids)


def judged(dataset, run) -> tuple[float, float]:
    """Position RMSE of the poses, m, and their mean NEES by degree of freedom."""
    from sequential.manifold import SE2

    rows, truth = dataset.truth.at(dataset.problem.t)
    poses = SE2().normalize(np.column_stack([truth.position, truth.heading]))
    mean, cov = run.values.rows["x"][rows], run.covs["x"][rows]
    error = SE2().local(mean, poses)
    squared = np.einsum("ni,nij,nj->n", error, np.linalg.inv(cov), error)
    rmse = np.sqrt(np.mean(np.sum((mean[:, :2] - truth.position) ** 2, axis=1)))
    return float(rmse), float(squared.mean()) / 3.0
