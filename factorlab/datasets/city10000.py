"""City10000: ten thousand steps through simulated streets, 200 of them with two readings of the odometry.

From gtsam's examples (`T1_city10000_04.txt`).  The truth beside it (`ISAM2_GT_city10000.txt`) is a solution
of the noise-free graph and stands on whole metres and right angles to 0.1 mm.  Errors of the readings at the
truth have standard deviations of 0.020 m, 0.020 m and 0.010 rad, odometry and loop closures alike.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Truth, require_file
from factorlab.datasets.slam import SlamDataset
from factorlab.datasets.wheel import gtsam_data
from sequential.errors import DataError
from sequential.manifold import SE2
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.files import CityGraph, read_city
from sequential.slam.initial import initial_poses
from sequential.slam.models import Between, Prior
from sequential.slam.models.groups import compose

__all__ = ["choose_readings", "load_city10000"]

Array = NDArray[np.float64]

SIGMAS = (0.02, 0.02, 0.01)  # m, m, rad
HELD = 1e-8
SECOND = 1_000_000_000  # ns
BESIDE = 25.0  # χ² by which a reading must be better than the next one to count as told
REMEDY = "it comes with the gtsam wheel; pip install gtsam, or name a folder with data=…"


def load_city10000(data: Path | None) -> SlamDataset:
    """The graph with the reading of each doubtful step that the loop closures tell."""
    folder = gtsam_data() if data is None else data
    path = require_file(folder / "T1_city10000_04.txt", "City10000", REMEDY)
    city = read_city(path)
    chosen, told = choose_readings(city)
    table = np.loadtxt(require_file(folder / "ISAM2_GT_city10000.txt", "the truth of City10000", REMEDY))
    truth = Truth(SECOND * np.arange(len(table)), table[:, :2], np.unwrap(table[:, 2]))
    return SlamDataset(
        name="city10000",
        title="City10000: 10 000 planar poses, 10 688 loop closures, 200 steps of odometry with two readings",
        problem=replace(_problem(city.ids, chosen), t=SECOND * np.arange(len(table))),
        truth=truth,
        notes=(
            f"{len(city.others)} steps have two readings; loop closures alone tell {told} of them apart.",
            "The truth is a solution of the noise-free graph, whole metres and right angles to 0.1 mm.",
            "The file carries no weights; σ of 0.02 m, 0.02 m and 0.01 rad are those of its simulation.",
        ),
        default_estimators=("batch", "batch_robust"),
        graph_options={"initial": "lago"},
    )


def _problem(ids: NDArray[np.int64], z: Array) -> SlamProblem:
    """Odometry and loop closures in groups of their own."""
    variances = np.square(SIGMAS)
    step = np.abs(ids[:, 1] - ids[:, 0]) == 1
    model = Between(SE2())
    groups = [Factors(Prior(SE2()), ("x",), [[0]], np.zeros((1, 3)), HELD, name="prior")]
    for name, rows in (("odometry", step), ("loop", ~step)):
        if rows.any():
            groups.append(Factors(model, ("x", "x"), ids[rows], z[rows], variances, name=name))
    return SlamProblem({"x": SE2()}, tuple(groups))


def choose_readings(city: CityGraph) -> tuple[Array, int]:
    """One reading for each edge: the nearest one at the poses of the graph without the doubtful edges.

    Doubtful steps that follow each other through a pose which nothing else sees are judged together, by where
    they lead.

    Returns
    -------
    z : (N, 3)
    told : of how many doubtful edges one reading is nearer by far

    Raises
    ------
    DataError
        where the graph falls apart without its doubtful edges.
    """
    doubtful = np.array(sorted(city.others), dtype=np.int64)
    if not len(doubtful):
        return city.z, 0
    sure = np.setdiff1d(np.arange(len(city.ids)), doubtful)
    poses = initial_poses(_problem(city.ids[sure], city.z[sure]), "lago")
    z, told = city.z.copy(), 0
    for run in _runs(city.ids[doubtful], poses):
        edges = doubtful[run]
        ends = city.ids[edges[0], 0], city.ids[edges[-1], 1]
        seen = [poses.at("x", np.array([end])) for end in ends]
        offers = [np.vstack([city.z[edge], city.others[int(edge)]]) for edge in edges]
        ways = list(product(*(range(len(offer)) for offer in offers)))
        led = np.stack([offers[0][way[0]] for way in ways])
        for k in range(1, len(edges)):
            led = compose(SE2(), led, np.stack([offers[k][way[k]] for way in ways]))
        off = Between(SE2()).errors(led, *(np.tile(pose, (len(ways), 1)) for pose in seen))
        cost = np.sum((off / SIGMAS) ** 2, axis=1) / len(edges)
        best = ways[int(np.argmin(cost))]
        z[edges] = [offer[reading] for offer, reading in zip(offers, best, strict=True)]
        told += len(edges) * bool(np.diff(np.sort(cost)[:2])[0] > BESIDE)
    return z, told


def _runs(ids: NDArray[np.int64], poses: Values) -> list[list[int]]:
    """Doubtful edges in runs from one known pose to another.

    Raises
    ------
    DataError
        naming a pose that no run of edges joins to the others.
    """
    known = poses.has("x", ids.ravel()).reshape(-1, 2)
    runs: list[list[int]] = []
    for k, (tail, _) in enumerate(known):
        follows = k and ids[k - 1, 1] == ids[k, 0]
        if tail:
            runs.append([k])
        elif follows and runs:
            runs[-1].append(k)
    lost = [run for run in runs if not known[run[-1], 1]]
    if lost or sum(map(len, runs)) != len(ids):
        where = ids[lost[0][-1], 1] if lost else ids[~known[:, 0]][0, 0]
        msg = f"pose {where} has only edges with several readings; nothing tells which of them is right"
        raise DataError(msg)
    return runs
