"""Victoria Park from raw data: does it converge, how well do its loops close, and what do filters make of it.

The reference's factors are those that gtsam.load2D makes of the file; from the file's own start (all trees at
the origin) Levenberg-Marquardt was stuck at a χ² of 210 200 after 100 iterations.  There is no truth, so the
revisits judge: the loop error is the distance between where a tree is by the sightings of one visit and where
the visit before had put it.  Visits that were kept back judge without having been used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gtsam
import numpy as np
from gtsam.symbol_shorthand import L

from factorlab.datasets.victoria_park import FILE, load_victoria_park
from factorlab.datasets.wheel import gtsam_data
from factorlab.graph.slam import BatchSlam, IncrementalSlam
from factorlab.graph.solve import optimise
from measure.figures import Figure, interleaved
from sequential.model import Loss
from sequential.slam import EkfSlam, SlamProblem, SlamRun, Values
from sequential.slam.beginnings import placed
from sequential.slam.revisits import loop_errors, without_visits

__all__ = ["figures"]

STUCK, QUICK_STEPS, KEPT_BACK = 210_200.0, 1500, 3
GROWN = BatchSlam("incremental", covariance=False)
ROBUST = BatchSlam("incremental", loss=Loss("cauchy", 2.385), covariance=False)


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    steps = QUICK_STEPS if quick else None
    (park,) = load_victoria_park(steps=steps)
    problem = park.problem
    batch = GROWN.solve(problem)
    fitted = load_victoria_park(steps=steps, fitted=True)[0].problem
    rows = {} if quick else reference_factors(batch.values)
    rows["victoria_park_chi2"] = Figure(
        batch.report.details["chi2"],
        "",
        f"our factors, noise as the file states it; freedom {freedom(problem)}",
        must=None if quick else 6346.97379 * (1.0 + 1e-4),
    )
    return rows | loops(problem, batch) | kept_back(problem, fitted) | duration()


def freedom(problem: SlamProblem) -> int:
    """Numbers that were measured, less those of the trees; odometry and prior fix one pose each."""
    return 2 * len(problem.factors[2]) - 2 * len(problem.indices("l"))


def reference_factors(values: Values) -> dict[str, Figure]:
    """The cost of gtsam's own reading of the file, begun from our values."""
    graph, start = gtsam.load2D(str(gtsam_data() / FILE))
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(), gtsam.noiseModel.Isotropic.Variance(3, 1e-8)))
    names = {name: number for number, name in enumerate(tree_names())}
    ours = gtsam.Values()
    poses = iter(values.rows["x"])
    for key in sorted(start.keys()):
        if key < L(0):
            ours.insert(key, gtsam.Pose2(*next(poses)))
        else:
            ours.insert(key, values.rows["l"][names[gtsam.Symbol(key).index()]])
    solved: Any = optimise(graph, ours)
    said = f"2 x error of the factors of gtsam.load2D; from the file's own start stuck at {STUCK:,.0f}"
    return {"victoria_park_chi2_of_gtsams_factors": Figure(2.0 * solved.cost, "", said, must=0.1 * STUCK)}


def tree_names() -> list[int]:
    """What the file calls its trees, ascending."""
    lines = Path(gtsam_data() / FILE).read_text().splitlines()
    return sorted({int(line.split()[2]) for line in lines if line.startswith("LANDMARK")})


def loops(problem: SlamProblem, batch: SlamRun) -> dict[str, Figure]:
    """Loop errors of everything, beside dead reckoning."""
    runs = {"dead reckoning": placed(problem), "EKF-SLAM": EkfSlam().solve(problem).values}
    errors = {name: loop_errors(problem, values).rms for name, values in runs.items()}
    own = loop_errors(problem, batch.values)
    robust = loop_errors(problem, ROBUST.solve(problem).values)
    said = ", ".join(f"{name} {value:.2f} m" for name, value in errors.items())
    return {
        "victoria_park_loop_error": Figure(
            own.rms,
            "m",
            f"RMS of {len(own.distance)} revisits, worst {own.worst:.1f} m; {said}; a sighting is said to be "
            "good to 0.63 m",
            must=1.0,
        ),
        "victoria_park_loop_error_robust": Figure(
            robust.rms, "m", f"Cauchy loss; worst {robust.worst:.1f} m"
        ),
        "victoria_park_loop_error_ekf_over_batch": Figure(
            errors["EKF-SLAM"] / own.rms,
            "x",
            "loop error of the filter over the batch's",
        ),
    }


def kept_back(stated: SlamProblem, fitted: SlamProblem) -> dict[str, Figure]:
    """How far sightings of visits that were not used are from where the batch expects them."""
    rows = {}
    for name, problem, must in (("", stated, None), ("_fitted_noise", fitted, 0.4)):
        rest, back = without_visits(problem, KEPT_BACK)
        values = GROWN.solve(rest).values
        index = np.asarray(back.index)
        expected = back.model.expected(values.at("x", index[:, 0]), values.at("l", index[:, 1]))
        off = np.linalg.norm(flat(expected) - flat(np.asarray(back.z)), axis=1)
        said = (
            f"{len(back)} sightings of one revisit in {KEPT_BACK}, not used; median {np.median(off):.2f} m, "
            f"loop error {loop_errors(stated, values).rms:.2f} m"
        )
        rmse = float(np.sqrt(np.mean(off**2)))
        rows[f"victoria_park_kept_back_rmse{name}"] = Figure(rmse, "m", said, must=must)
    return rows


def flat(polar: np.ndarray) -> np.ndarray:
    """Places (N, 2) of ranges and bearings."""
    return polar[:, :1] * np.column_stack([np.cos(polar[:, 1]), np.sin(polar[:, 1])])


def duration() -> dict[str, Figure]:
    """The first part by solves on the way and the batch, against iSAM2, which reaches the same cost."""
    problem = load_victoria_park(steps=QUICK_STEPS)[0].problem
    isam2 = IncrementalSlam(threshold=0.1, every=10, covariance=False, online=False)
    cost = [solver.solve(problem).report.details["chi2"] for solver in (GROWN, isam2)]
    times = interleaved({"grown": lambda: GROWN.solve(problem), "isam2": lambda: isam2.solve(problem)}, 3)
    said = f"first {QUICK_STEPS} poses, solves on the way included, over iSAM2 (0.1, every 10)"
    return {
        "victoria_park_isam2_apart_from_batch": Figure(
            abs(cost[1] / cost[0] - 1.0), "", "relative difference of the final χ²", must=1e-4
        ),
        "victoria_park_batch_time_over_isam2": Figure(times["grown"] / times["isam2"], "x", said),
    }
