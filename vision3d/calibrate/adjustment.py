"""Levenberg-Marquardt for one camera and many poses, by the Schur complement over the views.

The normal matrix is an arrow: camera parameters meet every view, views never meet each other.  Poses are
eliminated view by view, so that a step costs one small system (q, q) whatever the number of views.
Triggs, McLauchlan, Hartley, Fitzgibbon 2000, "Bundle adjustment - a modern synthesis", sections 6.1 and 6.3;
the damping is Nielsen's (1999, "Damping parameter in Marquardt's method").
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE3
from vision3d.calibrate.problem import Problem
from vision3d.lenses import LENS_CODE, LENSES

__all__ = ["Blocks", "Solution", "Unknowns", "adjust", "linearize", "schur"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SETTLED = 1e-10
"""The solve ends when a step promises less than this share of the cost: 1e-3 standard deviations or less."""
SHARP_PX = 1e-8
"""… or when it promises to move the corners by less than this, root of the mean square."""
ITERATIONS = 100
PRIOR_STD = {"rational8": 3.0, "thin12": 3.0}
"""Deviation from zero of the radial coefficients of lenses that divide two polynomials.  Top and bottom trade
places: without a bound they run off together to hundreds, and put a pole among the corners."""
RADIAL = frozenset({"k1", "k2", "k3", "k4", "k5", "k6"})
FAR_PX = 1e4
"""Taken for the distance of a corner that has no projection, such as one behind the camera."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What the adjustment moves: parameters (p,), the board's bend (2,) in m, poses (V, 7) camera_T_board."""

    lens: str
    parameters: Array
    warp: Array
    poses: Array


@dataclass(frozen=True, eq=False)
class Blocks:
    """Residuals (M, 2) and the arrow's blocks per view, named as in `vision3d.kernels.adjustment`.

    `prior` (q,) is the information of the bound on the coefficients, `pull` (q,) its score.
    """

    residuals: Array
    U: Array
    W: Array
    T: Array
    a: Array
    b: Array
    lost: int
    prior: Array
    pull: Array

    def cost(self, weights: Array) -> float:
        """Half the weighted sum of squares; a corner without a projection counts as `FAR_PX` off."""
        squares = self.residuals**2
        if self.lost:
            squares = np.where(np.isnan(squares), FAR_PX**2, squares)
        return 0.5 * float(np.sum(weights[:, None] * squares))

    def objective(self, weights: Array) -> float:
        """The cost, and what the bound on the coefficients adds to it."""
        held = self.prior > 0.0
        return self.cost(weights) + 0.5 * float(np.sum(self.pull[held] ** 2 / self.prior[held]))


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the solve ended: unknowns, their blocks, and how it went."""

    unknowns: Unknowns
    blocks: Blocks
    cost: float
    iterations: int
    converged: bool


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
    prior = _prior(unknowns.lens) * problem.scale**2
    pull = -prior * np.concatenate([unknowns.parameters, unknowns.warp])
    return Blocks(residuals, U, W, T, a, b, lost, prior, pull)


@cache
def _prior(lens: str) -> Array:
    """Information (q,) of the bound on the coefficients of a lens; zero for most."""
    names = (*LENSES[lens].parameters, "warp x", "warp y")
    bounded = np.array([name in RADIAL for name in names])
    prior = bounded / PRIOR_STD[lens] ** 2 if lens in PRIOR_STD else np.zeros(len(names))
    prior.flags.writeable = False
    return prior


def schur(blocks: Blocks, free: Mask, damping: float = 0.0) -> tuple[Array, Array, Array, Array]:
    """Eliminate the poses.

    Returns
    -------
    S : Array
        Reduced normal matrix of the free parameters, (f, f).
    right : Array
        Its right-hand side, (f,).
    T_inverse : Array
        Inverses of the poses' own blocks, (V, 6, 6).
    Y : Array
        -T⁻¹ W', (V, 6, f): how poses follow the parameters.
    """
    U = (blocks.U.sum(axis=0) + np.diag(blocks.prior))[np.ix_(free, free)]
    a = (blocks.a.sum(axis=0) + blocks.pull)[free]
    W, T = blocks.W[:, free], blocks.T
    if damping:
        U = U + damping * np.diag(np.diag(U))
        T = T + damping * T * np.eye(6)
    # scaled to a unit diagonal, since metres and radians differ by orders of magnitude
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("vii->vi", T), 1e-300))
    T_inverse = (
        np.linalg.inv(T * scale[:, :, None] * scale[:, None, :]) * scale[:, :, None] * scale[:, None, :]
    )
    Y = -T_inverse @ W.transpose(0, 2, 1)
    S = U + np.einsum("vpi,viq->pq", W, Y)
    right = a + np.einsum("vip,vi->p", Y, blocks.b)
    return 0.5 * (S + S.T), right, T_inverse, Y


@np.errstate(over="ignore", invalid="ignore")  # a step to what is not finite is refused
def adjust(
    problem: Problem,
    unknowns: Unknowns,
    weights: Array,
    free: Mask,
    *,
    iterations: int = ITERATIONS,
    settled: float = SETTLED,
) -> Solution:
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
    blocks = linearize(problem, unknowns, weights)
    cost, damping, growth = blocks.objective(weights), 1e-4, 2.0
    least = SHARP_PX**2 * float(weights.sum())
    for iteration in range(1, iterations + 1):
        step = _step(blocks, free, damping)
        if step is None:
            damping, growth = damping * growth, growth * 2.0
            continue
        camera_step, pose_steps, promised = step
        if promised <= max(settled * cost, least):
            return Solution(unknowns, blocks, cost, iteration, converged=True)
        moved = _moved(unknowns, camera_step, pose_steps)
        ahead = linearize(problem, moved, weights)
        fall = cost - ahead.objective(weights)
        if fall > 0.0:
            unknowns, blocks, cost = moved, ahead, cost - fall
            damping *= max(1.0 / 10.0, 1.0 - (2.0 * min(fall / promised, 1.0) - 1.0) ** 3)
            growth = 2.0
        elif promised <= 1e-9 * cost and fall > -1e-12 * cost:
            return Solution(unknowns, blocks, cost, iteration, converged=True)
        else:
            damping, growth = damping * growth, growth * 2.0
            if damping > 1e12:
                break
    return Solution(unknowns, blocks, cost, iterations, converged=False)


def _step(blocks: Blocks, free: Mask, damping: float) -> tuple[Array, Array, float] | None:
    """Steps of the parameters (q,) and of the poses (V, 6), and the fall of the cost that they promise."""
    try:
        S, right, T_inverse, Y = schur(blocks, free, damping)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(S), 1e-300))
        moved = scale * np.linalg.solve(S * scale[:, None] * scale[None, :], scale * right)
    except np.linalg.LinAlgError:
        return None
    pose_steps = np.einsum("vij,vj->vi", T_inverse, blocks.b) + Y @ moved
    camera_step = np.zeros(len(free))
    camera_step[free] = moved
    promised = 0.5 * float((blocks.a.sum(axis=0) + blocks.pull)[free] @ moved + np.sum(blocks.b * pose_steps))
    if not np.isfinite(promised):
        return None
    return camera_step, pose_steps, promised


def _moved(unknowns: Unknowns, camera_step: Array, pose_steps: Array) -> Unknowns:
    p = len(unknowns.parameters)
    return replace(
        unknowns,
        parameters=unknowns.parameters + camera_step[:p],
        warp=unknowns.warp + camera_step[p:],
        poses=SE3().retract(unknowns.poses, pose_steps),
    )
