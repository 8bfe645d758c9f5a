"""Levenberg-Marquardt for shared parameters and many poses, by the Schur complement over the poses.

The normal matrix is an arrow: parameters meet every view, views never meet each other.  Poses are eliminated
view by view, so that a step costs one small system (q, q) whatever the number of views.
Triggs, McLauchlan, Hartley, Fitzgibbon 2000, "Bundle adjustment - a modern synthesis", sections 6.1 and 6.3;
the damping is Nielsen's (1999, "Damping parameter in Marquardt's method").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["Blocks", "Solution", "descend", "schur"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
State = TypeVar("State")

SETTLED = 1e-10
"""The solve ends when a step promises less than this share of the cost: 1e-3 standard deviations or less."""
SHARP_PX = 1e-8
"""… or when it promises to move the corners by less than this, root of the mean square."""
ITERATIONS = 100
FAR_PX = 1e4
"""Taken for the distance of a corner that has no projection, such as one behind the camera."""


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
class Solution(Generic[State]):
    """Where the solve ended: unknowns, their blocks, and how it went."""

    unknowns: State
    blocks: Blocks
    cost: float
    iterations: int
    converged: bool


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
def descend(
    linearized: Callable[[State], Blocks],
    moved: Callable[[State, Array, Array], State],
    unknowns: State,
    weights: Array,
    free: Mask,
    *,
    iterations: int = ITERATIONS,
    settled: float = SETTLED,
) -> Solution[State]:
    """Minimise the weighted squares of residuals.

    Parameters
    ----------
    linearized : Callable[[State], Blocks]
        Residuals and weighted normal equations at some unknowns.
    moved : Callable[[State, Array, Array], State]
        Unknowns after a step (q,) of the parameters and steps (V, 6) of the poses.
    unknowns : State
        Where to begin.
    weights : Array
        Weight of every corner, (M,), 1/px².
    free : Mask
        Which parameters move, (q,).  Poses always move.
    iterations : int
        Steps tried at most.
    settled : float
        The solve ends when a step promises less than this share of the cost.
    """
    blocks = linearized(unknowns)
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
        there = moved(unknowns, camera_step, pose_steps)
        ahead = linearized(there)
        fall = cost - ahead.objective(weights)
        if fall > 0.0:
            unknowns, blocks, cost = there, ahead, cost - fall
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
