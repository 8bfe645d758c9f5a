"""The adjustment of one camera and of the poses of a board; `vision3d.calibrate.descent` solves it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE3
from vision3d.calibrate.descent import ITERATIONS, SETTLED, Blocks, Solution, descend
from vision3d.calibrate.problem import Problem
from vision3d.lenses import LENS_CODE, LENSES

__all__ = ["Unknowns", "adjust", "linearize", "prior_of"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PRIOR_STD = {"rational8": 3.0, "thin12": 3.0}
"""Deviation from zero of the radial coefficients of lenses that divide two polynomials.  Top and bottom trade
places: without a bound they run off together to hundreds, and put a pole among the corners."""
RADIAL = frozenset({"k1", "k2", "k3", "k4", "k5", "k6"})


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What the adjustment moves: parameters (p,), the board's bend (2,) in m, poses (V, 7) camera_T_board."""

    lens: str
    parameters: Array
    warp: Array
    poses: Array


def linearize(problem: Problem, unknowns: Unknowns, weights: Array) -> Blocks:
    """Residuals and normal equations of all views, weighted by `weights` (M,)."""
    from vision3d.kernels.adjustment import normal_equations

    V, q = problem.count, len(unknowns.parameters) + 2
    residuals = np.empty((len(problem.points), 2))
    U, W, T = np.empty((V, q, q)), np.empty((V, q, 6)), np.empty((V, 6, 6))
    a, b = np.empty((V, q)), np.empty((V, 6))
    lost = normal_equations(
        LENS_CODE[unknowns.lens],
        np.ascontiguousarray(unknowns.parameters),
        np.ascontiguousarray(unknowns.warp),
        np.ascontiguousarray(unknowns.poses),
        problem.starts,
        problem.points,
        problem.bend,
        problem.pixels,
        weights,
        *(residuals, U, W, T, a, b),
    )
    prior = prior_of(unknowns.lens) * problem.scale**2
    pull = -prior * np.concatenate([unknowns.parameters, unknowns.warp])
    return Blocks(residuals, U, W, T, a, b, lost, prior, pull)


@cache
def prior_of(lens: str) -> Array:
    """Information (q,) of the bound on the coefficients of a lens; zero for most."""
    names = (*LENSES[lens].parameters, "warp x", "warp y")
    bounded = np.array([name in RADIAL for name in names])
    prior = bounded / PRIOR_STD[lens] ** 2 if lens in PRIOR_STD else np.zeros(len(names))
    prior.flags.writeable = False
    return prior


def adjust(
    problem: Problem,
    unknowns: Unknowns,
    weights: Array,
    free: Mask,
    *,
    iterations: int = ITERATIONS,
    settled: float = SETTLED,
) -> Solution[Unknowns]:
    """Minimise the weighted squares of the residuals.

    Parameters
    ----------
    problem : Problem
        Corners of the views.
    unknowns : Unknowns
        Where to begin.
    weights : Array
        Weight of every corner, (M,), 1/px².
    free : Mask
        Which parameters move, (p + 2,): the camera's, then the two of a bent board.  Poses always move.
    iterations : int
        Steps tried at most.
    settled : float
        The solve ends when a step promises less than this share of the cost.

    Returns
    -------
    Solution
        The best that was met; `converged` says whether the solve settled there.
    """

    def linearized(at: Unknowns) -> Blocks:
        return linearize(problem, at, weights)

    return descend(linearized, _moved, unknowns, weights, free, iterations=iterations, settled=settled)


def _moved(unknowns: Unknowns, camera_step: Array, pose_steps: Array) -> Unknowns:
    p = len(unknowns.parameters)
    return replace(
        unknowns,
        parameters=unknowns.parameters + camera_step[:p],
        warp=unknowns.warp + camera_step[p:],
        poses=SE3().retract(unknowns.poses, pose_steps),
    )
