"""Pose graphs from files: the benchmarks that everybody quotes, and any file of your own.

Intel and MIT (Killian Court) are laser scans matched by Cyrill Stachniss and others, in the form of SE-Sync's
repository; `sphere2500` and `w10000` are simulations that the gtsam wheel carries.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Truth, require_file
from factorlab.datasets.slam import SlamDataset
from factorlab.datasets.wheel import gtsam_data
from sequential.errors import ModelError, UnderConstrainedError
from sequential.slam.files import GraphFile, problem_of, read_graph
from sequential.slam.initial import initial_poses, links_of

__all__ = ["load_graph_file", "load_intel", "load_mit", "load_sphere2500", "load_w10000"]

Array = NDArray[np.float64]

NO_TRUTH = "There is no truth: online estimators are scored against the batch, which has all measurements."
ALL = ("isam2", "isam2_final", "fixed_lag", "batch", "batch_robust", "gnc")
SECOND = 1_000_000_000  # ns: poses of a graph file have no times, so that each takes one
LARGE = 2000  # poses beyond which iSAM2 looks every tenth step for what to relinearise
NO_TIMES = "A graph file has no times; a step counts as a second."
MANY = 4000  # poses beyond which iSAM2 takes minutes, unless it is asked for
WHEEL = "it comes with the gtsam wheel; pip install gtsam, or name a folder with data=…"
SE_SYNC = (
    "put the g2o files of github.com/david-m-rosen/SE-Sync there, in a folder pose_graph under the one that "
    "FACTORLAB_DATA names, or name their folder with data=…"
)


def load_intel(data: Path | None) -> SlamDataset:
    """The Intel research lab in Seattle: 1728 poses, 785 loop closures."""
    return _benchmark("intel.g2o", "Intel research lab", data, 45.0042)


def load_mit(data: Path | None) -> SlamDataset:
    """The Infinite Corridor round MIT's Killian Court: 808 poses, 20 loop closures over 1.9 km."""
    extra = (
        "From the odometry Levenberg-Marquardt ends in a local minimum, χ² = 770.239; LAGO, the chordal "
        "relaxation and a spanning tree of the surest headings all lead to 41.2069."
    )
    online = "iSAM2 and windows begin with the odometry and do not recover from it; --estimators runs them."
    names = ("batch", "batch_robust", "gnc")
    return _benchmark("MIT.g2o", "MIT Killian Court", data, 41.2069, (extra, online), names)


def _benchmark(
    name: str,
    title: str,
    data: Path | None,
    chi2: float,
    notes: tuple[str, ...] = (),
    estimators: tuple[str, ...] = ALL,
) -> SlamDataset:
    path = require_file(_folder(data) / name, title, SE_SYNC)
    known = {"chi2": chi2}
    return _dataset(
        read_graph(path),
        Path(name).stem.lower(),
        title,
        known,
        (NO_TRUTH, *notes),
        estimators,
        {"initial": "lago"},
    )


def _folder(data: Path | None) -> Path:
    return Path(os.environ.get("FACTORLAB_DATA", ".")) / "pose_graph" if data is None else data


def load_w10000(data: Path | None) -> SlamDataset:
    """A simulated walk on a grid: 10 000 poses, 54 312 loop closures."""
    path = require_file((gtsam_data() if data is None else data) / "w10000.graph", "w10000", WHEEL)
    graph = read_graph(path)
    loose = "Its weights are all one, σ of 1 m and 1 rad: χ² is a five-hundredth of its degrees of freedom."
    return _dataset(
        graph,
        "w10000",
        "w10000: a simulated walk on a grid",
        {"chi2": 289.735},
        (NO_TRUTH, loose),
        ("batch", "batch_robust"),
        {"initial": "lago"},
    )


def load_sphere2500(data: Path | None) -> list[SlamDataset]:
    """A simulated flight round a sphere, with its weights as GTSAM reads them and as iSAM wrote them."""
    folder = gtsam_data() if data is None else data
    path = require_file(folder / "sphere2500.txt", "sphere2500", WHEEL)
    truth = _sphere_truth(
        require_file(folder / "sphere2500_groundtruth.txt", "the truth of sphere2500", WHEEL)
    )
    common = (
        "The file is iSAM's: its numbers are square roots of information, translation first.",
        "At the truth errors are 0.100 m, 0.010 rad about x and y, 0.040 rad about z: what these roots say.",
        "The truth is composed from the noise-free odometry of sphere2500_groundtruth.txt.",
    )
    title = "sphere2500: a simulated flight round a sphere"
    as_gtsam = _dataset(
        read_graph(path, weights="gtsam"),
        "sphere2500",
        f"{title}, weights as GTSAM reads them",
        {"chi2": 2266.04},
        ("GTSAM takes the roots for information, rotation first: compare χ², do not believe σ.", *common),
        ("batch", "batch_robust"),
        {"initial": "chordal", "method": "dogleg"},
        truth,
    )
    as_isam = _dataset(
        read_graph(path, weights="square_root"),
        "sphere2500_isam",
        f"{title}, weights as iSAM wrote them",
        {},
        common,
        ("batch", "batch_robust"),
        {"initial": "chordal"},
        truth,
    )
    return [as_gtsam, as_isam]


def _sphere_truth(path: Path) -> Truth:
    """Poses (2500) composed from noise-free odometry."""
    poses = initial_poses(problem_of(read_graph(path)), "odometry").rows["x"]
    return Truth(SECOND * np.arange(len(poses)), poses[:, 4:], None, poses[:, :4])


def load_graph_file(path: str | os.PathLike[str]) -> SlamDataset:
    """Any g2o or TORO graph of a user's own.

    Raises
    ------
    DataError, FileFormatError
        naming the line.
    """
    graph = read_graph(path)
    notes = [NO_TRUTH]
    if graph.skipped:
        told = ", ".join(f"{tag} ({count})" for tag, count in sorted(graph.skipped.items()))
        notes.append(f"Lines with these tags are not understood and were left out: {told}.")
    plain = not len(graph.displacements) and not len(graph.sightings)
    names = ("isam2_final", "batch", "batch_robust", *(("gnc",) if plain else ()))
    options: dict[str, object] = {"initial": "lago" if graph.axes == 2 else "chordal"}
    if len(graph.pose_ids()) > MANY:
        names = tuple(name for name in names if name != "isam2_final")
    name = Path(path).stem
    return _dataset(graph, name, f"{name}: a graph file", {}, tuple(notes), names, options)


def _dataset(
    graph: GraphFile,
    name: str,
    title: str,
    reference: dict[str, float],
    notes: tuple[str, ...],
    estimators: tuple[str, ...],
    options: dict[str, object],
    truth: Truth | None = None,
) -> SlamDataset:
    problem = problem_of(graph)
    try:
        links_of(problem)
    except (ModelError, UnderConstrainedError):  # relative poses do not reach every pose
        options = {**options, "initial": "steps"}
    else:
        # whatever wrote the vertices has seen all edges: an online estimator must begin without them
        problem = replace(problem, start=None)
    problem = replace(problem, t=SECOND * np.arange(len(graph.pose_ids())))
    sizes = [f"{len(graph.pose_ids())} poses"]
    if len(graph.landmark_ids()):
        sizes.append(f"{len(graph.landmark_ids())} landmarks")
    loops = sum(len(group) for group in problem.factors if group.name == "loop")
    if loops:
        sizes.append(f"{loops} loop closures")
    return SlamDataset(
        name=name,
        title=f"{title}; {', '.join(sizes)}",
        problem=problem,
        truth=truth,
        axes=graph.axes,
        reference=reference,
        notes=(*notes, NO_TIMES),
        default_estimators=estimators,
        isam_every=10 if len(graph.pose_ids()) > LARGE else 1,
        graph_options=options,
    )
