"""Did the rig stay as it was?  What every pair alone says of the cameras' pose, against all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE3
from vision3d.calibrate.descent import schur
from vision3d.stereo.calibration import StereoCalibration
from vision3d.stereo.held_out import problem_of
from vision3d.stereo.joint_problem import JointUnknowns, adjust_jointly

__all__ = ["Deviations", "Step", "deviations"]

Array = NDArray[np.float64]

MEDIAN_CHI2, LIMIT_CHI2 = 5.348, 27.9
"""Median of χ² with six degrees of freedom, and what one in ten thousand exceeds."""
FEWEST = 6
"""Pairs from which a step is looked for, at least two on either side of it."""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """The rig changed between two pairs.

    Parameters
    ----------
    before, after : numbers of the last pair before it and of the first one after it
    rotation_rad, translation_m : how far
    chi2 : of no step, with six degrees of freedom
    """

    before: int
    after: int
    rotation_rad: float
    translation_m: float
    chi2: float


@dataclass(frozen=True, eq=False)
class Deviations:
    """What pairs say of the rig, one by one, the cameras known.

    Attributes
    ----------
    pairs : tuple[int, ...]
        Numbers of the pairs that both cameras saw.
    steps : Array
        (K, 6) from the rig to the pair's own pose of it, rotation then translation; rad, m.
    covs : Array
        (K, 6, 6) of these, the pairs' common scatter in them.
    chi2 : Array
        (K,), six degrees of freedom.
    scatter : float
        Factor on the standard deviations that the pairs' scatter asks for; at least 1.
    moved : tuple[int, ...]
        Pairs in which the rig was not where it was in the others.
    step : Step | None
        Where the rig changed for good, if it did.
    """

    pairs: tuple[int, ...]
    steps: Array
    covs: Array
    chi2: Array
    scatter: float
    moved: tuple[int, ...]
    step: Step | None


def deviations(calibration: StereoCalibration) -> Deviations:
    """Pose of the cameras from every pair alone, and whether it is the one of all."""
    problem, weights, at = problem_of(calibration)
    free = np.arange(at.count) < 6
    whole, found, informations = calibration.whole, [], []
    for v in whole:
        own = JointUnknowns(at.lenses, at.right_T_left, at.left, at.right, at.warp, at.poses[v : v + 1])
        solution = adjust_jointly(problem.only([v]), own, weights[problem.pair_of == v], free, settled=1e-9)
        found.append(SE3().local(at.right_T_left, solution.unknowns.right_T_left))
        informations.append(schur(solution.blocks, free)[0] / calibration.sigma_scale**2)
    steps, information = np.array(found), np.array(informations)
    covs = np.asarray(np.linalg.inv(information), dtype=np.float64)
    chi2 = np.einsum("vi,vij,vj->v", steps, information, steps)
    factor = max(1.0, float(np.median(chi2)) / MEDIAN_CHI2)
    moved = tuple(v for v, value in zip(whole, chi2 / factor, strict=True) if value > LIMIT_CHI2)
    return Deviations(
        whole,
        steps,
        factor * covs,
        chi2 / factor,
        float(np.sqrt(factor)),
        moved if len(whole) >= FEWEST else (),
        _step(whole, steps, information),
    )


def _step(whole: tuple[int, ...], steps: Array, information: Array) -> Step | None:
    """The most likely place of a step, where a step explains the pairs much better than none."""
    K = len(whole)
    if K < FEWEST:
        return None
    best: Step | None = None
    for k in range(2, K - 1):
        sides = (slice(0, k), slice(k, K))
        sums = [information[side].sum(axis=0) for side in sides]
        means = [
            np.linalg.solve(total, np.einsum("vij,vj->i", information[side], steps[side]))
            for side, total in zip(sides, sums, strict=True)
        ]
        about = steps - np.concatenate(
            [np.broadcast_to(means[0], (k, 6)), np.broadcast_to(means[1], (K - k, 6))]
        )
        left = np.einsum("vi,vij,vj->v", about, information, about)
        factor = max(1.0, float(np.median(left)) / MEDIAN_CHI2)
        apart = means[1] - means[0]
        spread = np.linalg.inv(sums[0]) + np.linalg.inv(sums[1])
        chi2 = float(apart @ np.linalg.solve(spread, apart)) / factor
        if best is None or chi2 > best.chi2:
            turn, shift = float(np.linalg.norm(apart[:3])), float(np.linalg.norm(apart[3:]))
            best = Step(whole[k - 1], whole[k], turn, shift, chi2)
    return best if best is not None and best.chi2 > LIMIT_CHI2 + 2.0 * np.log(K) else None
