"""Final costs of the pose graphs that everybody quotes, and the time beside GTSAM's own route to them.

`intel` and `mit` lie in FACTORLAB_DATA/pose_graph; the others come with the gtsam wheel.  χ² is twice GTSAM's
error, with a prior of variance 1e-8 on the first pose.
"""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from factorlab.datasets import load_slam
from factorlab.datasets.slam import SlamDataset
from factorlab.graph.slam import BatchSlam
from factorlab.graph.slam.batch import native_graph
from measure.figures import Figure, interleaved
from sequential.slam.initial import initial_poses

if TYPE_CHECKING:
    from sequential.slam import SlamRun

RELATIVE = 1e-4
MUST = {"intel": 45.0042, "mit": 770.239, "sphere2500": 2266.04, "w10000": 289.735}
AIM = {"mit": 769.0}
STARTS = ("odometry", "tree", "chordal", "lago")
TRUTH = ("sphere2500_isam", "city10000")


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows."""
    rows: dict[str, Figure] = {}
    names = ("intel", "mit", "sphere2500") if quick else (*MUST, "city10000")
    for name in names:
        for dataset in load_slam(name):
            rows |= final_cost(dataset)
            if dataset.name == "mit":
                rows |= starts(dataset)
            if dataset.name in {"intel", "w10000"} and not quick:
                rows |= relaxation_time(dataset)
    return rows


def solved(dataset: SlamDataset, **options: object) -> SlamRun:
    """The batch from the dataset's own start, without marginals."""
    return BatchSlam(**{**dataset.graph_options, "covariance": False, **options}).solve(dataset.problem)


def final_cost(dataset: SlamDataset) -> dict[str, Figure]:
    """Final χ²; where there is a truth, χ² over its degrees of freedom and the RMSE too."""
    run, name = solved(dataset), dataset.name
    problem, details = dataset.problem, run.report.details
    dof = sum(len(g) * g.model.measured.dim for g in problem.factors)
    dof -= sum(len(problem.indices(kind)) * m.dim for kind, m in problem.kinds.items())
    said = (
        f"{run.report.iterations} steps from {dataset.graph_options['initial']}, {run.report.seconds:.2f} s "
        f"(start {details['initial_s']:.2f}, build {details['build_s']:.2f}, solve {details['solve_s']:.2f})"
    )
    bar, aim = MUST.get(name), AIM.get(name)
    must = None if bar is None else bar * (1 + RELATIVE)
    rows = {f"pose_graph_{name}_chi2": Figure(details["chi2"], "", said, must, aim or must)}
    if name in TRUTH and dataset.truth is not None:
        at = slice(0, 2) if dataset.axes == 2 else slice(4, 7)
        off = run.values.rows["x"][:, at] - dataset.truth.position
        rmse = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
        rows[f"pose_graph_{name}_chi2_per_dof"] = Figure(
            details["chi2"] / dof, "", f"{dof} degrees of freedom"
        )
        rows[f"pose_graph_{name}_rmse"] = Figure(rmse, "m", "positions against the truth, not aligned")
    return rows


def starts(dataset: SlamDataset) -> dict[str, Figure]:
    """How many of the starts lead to the lowest cost, by Levenberg-Marquardt."""
    costs = {
        name: solved(dataset, initial=name, method="levenberg_marquardt", check=False).report.details["chi2"]
        for name in STARTS
    }
    good = sum(cost <= min(costs.values()) * (1 + RELATIVE) for cost in costs.values())
    said = ", ".join(f"{name} {cost:.6g}" for name, cost in costs.items())
    return {
        f"pose_graph_{dataset.name}_good_starts": Figure(
            float(good), f"of {len(STARTS)}", said, better="higher"
        )
    }


def relaxation_time(dataset: SlamDataset) -> dict[str, Figure]:
    """Our LAGO with one Gauss-Newton solve, over GTSAM's Levenberg-Marquardt from the odometry."""
    problem = dataset.problem
    native = native_graph(problem)
    assert native is not None
    begun = native.insert(initial_poses(problem, "odometry"))

    def theirs() -> None:
        gtsam.LevenbergMarquardtOptimizer(native.graph, begun).optimize()

    rounds = 3 if len(problem.indices("x")) < 5000 else 1
    if rounds == 1:  # a warm-up would take as long again
        times = {}
        for name, work in (("ours", lambda: solved(dataset)), ("theirs", theirs)):
            began = perf_counter()
            work()
            times[name] = perf_counter() - began
    else:
        times = interleaved({"ours": lambda: solved(dataset), "theirs": theirs}, rounds)
    said = f"ours, with LAGO and build, {times['ours']:.2f} s; gtsam LM from odometry {times['theirs']:.2f} s"
    return {f"pose_graph_{dataset.name}_time_over_gtsam": Figure(times["ours"] / times["theirs"], "x", said)}
