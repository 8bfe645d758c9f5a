"""Intel with false loop closures: graduated non-convexity beside losses that are not graduated.

False closures join poses drawn at random, with relative poses drawn at random and covariances drawn from the
true closures.  There is no truth: the batch on the clean graph stands in for it, and the scale of an error is
what the odometry alone leaves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from factorlab.datasets import load_slam
from factorlab.graph.slam import BatchSlam, GncSlam
from measure.figures import Figure, say
from sequential.manifold import SE2
from sequential.model import Loss
from sequential.slam import SlamProblem, SlamRun, Values
from sequential.slam.initial import initial_poses

SHARES = {0.3: 5, 0.5: 3}  # of all closures, and seeds
MUST_SHARE = 0.3
SPREAD_M = 2.0  # of false relative positions, each axis
WITHIN = 0.1  # of the odometry's own error


def with_false_loops(problem: SlamProblem, share: float, seed: int) -> SlamProblem:
    """The problem with as many false closures that they are `share` of all."""
    rng = np.random.default_rng(seed)
    loop = next(group for group in problem.factors if group.name == "loop")
    poses, count = len(problem.indices("x")), round(share / (1 - share) * len(loop))
    pairs = np.sort(rng.integers(0, poses, (3 * count, 2)), axis=1)
    pairs = pairs[pairs[:, 1] - pairs[:, 0] > 1][:count]
    turn = rng.uniform(-np.pi, np.pi, (count, 1))
    z = SE2().normalize(np.hstack([SPREAD_M * rng.standard_normal((count, 2)), turn]))
    noise = loop.covs()[rng.integers(0, len(loop), count)]
    false = replace(loop, index=pairs, z=z, noise_cov=noise, name="false")
    return replace(problem, factors=(*problem.factors, false))


def off(values: Values, clean: SlamRun) -> float:
    """Absolute trajectory error, m, against the clean batch, not aligned."""
    gap = values.rows["x"][:, :2] - clean.values.rows["x"][:, :2]
    return float(np.sqrt(np.mean(np.sum(gap**2, axis=1))))


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Errors over those of the odometry, worst over seeds; what was believed; the alternatives at 30 %."""
    (dataset,) = load_slam("intel")
    clean = BatchSlam(initial="lago", covariance=False).solve(dataset.problem)
    scale = off(initial_poses(dataset.problem, "odometry"), clean)
    rows: dict[str, Figure] = {}
    for share, count in SHARES.items():
        seeds = range(1 if quick else count)
        worst, deceived, lost, told = 0.0, 0, 0, []
        for seed in seeds:
            result = GncSlam(covariance=False).solve_weighted(with_false_loops(dataset.problem, share, seed))
            ate = off(result.run.values, clean)
            worst = max(worst, ate)
            deceived += int(np.sum(result.weights[-1] > 0.5))
            lost += int(np.sum(result.weights[-2] < 0.5))
            told.append(f"{ate:.1e}")
            say(f"false loops {share:.0%}, seed {seed}: {ate:.2e} m, {result.run.report.seconds:.1f} s")
        name = f"false_loops_{share * 100:.0f}"
        said = f"m: {', '.join(told)}; odometry alone {scale:.3f} m"
        bars = (WITHIN, WITHIN) if share == MUST_SHARE else (None, WITHIN)
        rows[f"{name}_ate_over_odometry"] = Figure(worst / scale, "x", said, *bars)
        together = f"closures, {len(seeds)} seeds together"
        rows[f"{name}_false_believed"] = Figure(float(deceived), "", together)
        rows[f"{name}_true_rejected"] = Figure(float(lost), "", together)
    return rows | alternatives(dataset.problem, clean, scale, quick=quick)


def alternatives(problem: SlamProblem, clean: SlamRun, scale: float, *, quick: bool) -> dict[str, Figure]:
    """The same errors with other losses, one seed, 30 % false."""
    spoilt = with_false_loops(problem, MUST_SHARE, 0)
    loss = Loss("cauchy", 2.385)
    others = {
        "cauchy": BatchSlam(initial="odometry", loss=loss, covariance=False, check=False, max_iterations=30),
        "dcs": GncSlam(loss="dcs", covariance=False, initial="trusted", check=False),
        "gm": GncSlam(loss="gm", covariance=False, initial="trusted", check=False),
    }
    rows = {}
    for name, estimator in list(others.items())[: 1 if quick else 3]:
        run = estimator.solve(spoilt)
        ate = off(run.values, clean)
        said = f"{ate:.3g} m, {run.report.seconds:.1f} s, seed 0"
        rows[f"false_loops_30_{name}_ate_over_odometry"] = Figure(ate / scale, "x", said)
    return rows
