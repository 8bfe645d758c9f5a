"""Does each estimator know how wrong its last pose is?  Loops among unknown landmarks, drawn fifty times.

The robot goes round 3.8 times with the declared noise; the NEES of its last pose, averaged over the runs, is
held to the 95 % band of a matched estimator.
"""

from __future__ import annotations

import numpy as np

from measure.figures import Figure, say

__all__ = ["figures"]

RUNS, QUICK = 50, 10
SCALE = 1.5  # on the noise of `slam_worlds.loops`
REPAIRED = {"first_estimates": "first-estimates Jacobians", "invariant": "invariant error"}


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Mean NEES of the last pose by degree of freedom, of filters and of the batch."""
    from sequential.evaluate import chi2_band

    runs = QUICK if quick else RUNS
    values, errors = drawn(runs)
    low, high = (bound / 3.0 for bound in chi2_band(3, runs))
    mean = {name: float(np.mean(one)) / 3.0 for name, one in values.items()}
    rmse = {name: float(np.sqrt(np.mean(np.square(one)))) for name, one in errors.items()}
    band = f"95 % band {low:.2f}-{high:.2f}, {runs} runs"
    rows = {
        "loops_anees_ekf": Figure(
            mean["standard"], "per dof", f"EKF-SLAM is overconfident: {band}", high, better="higher"
        ),
        "loops_anees_batch": Figure(mean["batch"], "per dof", f"the batch is honest: {band}", high),
        "loops_anees_batch_at_least": Figure(mean["batch"], "per dof", band, low, better="higher"),
    }
    rows |= {
        f"loops_anees_{name}": Figure(mean[name], "per dof", f"EKF-SLAM with {told}: {band}")
        for name, told in REPAIRED.items()
    }
    told = ", ".join(f"{name} {value:.3f}" for name, value in rmse.items())
    rows["loops_rmse_ekf_over_batch"] = Figure(rmse["standard"] / rmse["batch"], "x", f"last pose, m: {told}")
    return rows


def drawn(runs: int) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """NEES and position error (m) of the last pose, by estimator and run."""
    from slam_worlds import last_nees, loops

    from factorlab.graph.slam import BatchSlam
    from sequential.slam import EkfSlam
    from sequential.slam.ekf import filtered_start

    estimators = {name: EkfSlam(name) for name in ("standard", *REPAIRED)}
    estimators["batch"] = BatchSlam(initial=filtered_start, covariance=("x",))
    values: dict[str, list[float]] = {name: [] for name in estimators}
    errors: dict[str, list[float]] = {name: [] for name in estimators}
    for seed in range(runs):
        world = loops(np.random.default_rng(seed), scale=SCALE)
        for name, estimator in estimators.items():
            run = estimator.solve(world.problem)
            values[name].append(last_nees(run, world))
            errors[name].append(float(np.linalg.norm(run.values.rows["x"][-1, :2] - world.poses[-1, :2])))
        if seed % 10 == 9:
            say(f"simulated loops: {seed + 1} of {runs}")
    return values, errors
