"""Bundle adjustment by Levenberg-Marquardt on compiled Jacobians, points eliminated: any lens, any loss.

    solved = adjust(problem, state, loss="soft_l1")

Robust losses are met by reweighting (Triggs et al. 2000, section 4.3); damping is Nielsen's (1999, "Damping
parameter in Marquardt's method").  The gauge is left to the damping, which moves every unknown as little as
it can: the cost does not depend on it, and `vision3d.sfm.gauge` puts the result where it is wanted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.sfm.bundle_problem import BundleProblem, BundleState, Linearized
from vision3d.sfm.losses import check_loss, loss_of

__all__ = ["Adjusted", "Reduced", "adjust", "cost_of", "reduce"]

Array = NDArray[np.float64]

SETTLED = 1e-12
"""The solve ends when a step promises less than this share of the cost."""
SHARP_PX = 1e-9
"""… or when it promises to move the projections by less than this, root of the mean square."""
LOST_PX = 1e4
"""Taken for the residual of an observation without a projection, such as a point behind the camera."""


@dataclass(frozen=True, eq=False)
class Reduced:
    """Normal equations of the views, the points eliminated, as `vision3d.kernels.bundle_schur` says."""

    S: Array
    g: Array
    U: Array
    T_inverse: Array
    b: Array
    free_points: int


@dataclass(frozen=True, eq=False)
class Adjusted:
    """Where a solve ended.

    Attributes
    ----------
    state : BundleState
        The best that was met.
    cost : float
        ½ Σ ρ(|r|²) there, px²: COLMAP's.
    initial_cost : float
        The same where it began.
    decrement : float
        What one more step promises to take off the cost.
    iterations : int
        Steps tried.
    converged : bool
        Whether the solve settled.
    """

    state: BundleState
    cost: float
    initial_cost: float
    decrement: float
    iterations: int
    converged: bool


def cost_of(residuals: Array, loss: str, scale_px: float) -> tuple[float, Array]:
    """½ Σ ρ(|r|²), px², and the weight (K,) of every observation; what has no projection weighs nothing."""
    squares = np.sum(residuals**2, axis=1)
    lost = ~np.isfinite(squares)
    rho, weights = loss_of(loss, np.where(lost, LOST_PX**2, squares), scale_px)
    return 0.5 * float(rho.sum()), np.where(lost, 0.0, weights)


def reduce(problem: BundleProblem, linear: Linearized, weights: Array, damping: float = 0.0) -> Reduced:
    """Eliminate the points."""
    from vision3d.kernels.bundle_schur import eliminate

    n, N = problem.size, len(problem.starts) - 1
    S, g, U, T_inverse, b = (
        np.empty((n, n)), np.empty(n), np.empty(n), np.empty((N, 3, 3)), np.empty((N, 3)),
    )  # fmt: skip
    residuals = np.where(np.isfinite(linear.residuals), linear.residuals, 0.0)
    free = eliminate(
        problem.images, problem.starts, problem.columns, weights, residuals,
        linear.by_view, linear.by_point, damping, S, g, U, T_inverse, b,
    )  # fmt: skip
    return Reduced(S, g, U, T_inverse, b, free)


def follow(
    problem: BundleProblem, linear: Linearized, weights: Array, reduced: Reduced, step: Array
) -> Array:
    """Steps (N, 3) of the points that go with a step (n,) of the views."""
    from vision3d.kernels.bundle_schur import back_substitute

    moved = np.empty((len(problem.starts) - 1, 3))
    back_substitute(
        problem.images, problem.starts, problem.columns, weights, linear.by_view, linear.by_point,
        reduced.T_inverse, reduced.b, step, moved,
    )  # fmt: skip
    return moved


@np.errstate(over="ignore", invalid="ignore")  # a step to what is not finite is refused
def adjust(
    problem: BundleProblem,
    state: BundleState,
    *,
    loss: str | None = None,
    loss_px: float = 1.0,
    iterations: int = 100,
    settled: float = SETTLED,
) -> Adjusted:
    """Minimise ½ Σ ρ(|pixel − projection|²).

    Parameters
    ----------
    problem : observations and what is free
    state : where to begin
    loss : name in `vision3d.sfm.losses.LOSSES`; None for least squares
    loss_px : residual from which the loss begins to doubt
    iterations : steps tried at most
    settled : the solve ends when a step promises less than this share of the cost

    Raises
    ------
    ModelError
        for an unknown loss.
    """
    name = check_loss(loss, loss_px)
    linear = problem.linearize(state)
    cost, weights = cost_of(linear.residuals, name, loss_px)
    start, least = cost, 0.5 * SHARP_PX**2 * len(problem.images)
    damping, growth, promised = 1e-4, 2.0, np.inf
    for iteration in range(1, iterations + 1):
        tried = _step(problem, linear, weights, damping)
        if tried is None:
            damping, growth = damping * growth, growth * 2.0
            continue
        step, point_steps, promised = tried
        if promised <= max(settled * cost, least):
            return Adjusted(state, cost, start, promised, iteration, converged=True)
        ahead = problem.moved(state, step, point_steps)
        residuals = problem.residuals(ahead)
        fall = cost - cost_of(residuals, name, loss_px)[0]
        if fall > 0.0:
            state, linear = ahead, problem.linearize(ahead)
            cost, weights = cost_of(linear.residuals, name, loss_px)
            damping *= max(1.0 / 10.0, 1.0 - (2.0 * min(fall / promised, 1.0) - 1.0) ** 3)
            damping, growth = max(damping, 1e-14), 2.0
        elif promised <= 1e-9 * cost and fall > -1e-12 * cost:
            return Adjusted(state, cost, start, promised, iteration, converged=True)
        else:
            damping, growth = damping * growth, growth * 2.0
            if damping > 1e14:
                break
    return Adjusted(state, cost, start, promised, iterations, converged=False)


def _step(
    problem: BundleProblem, linear: Linearized, weights: Array, damping: float
) -> tuple[Array, Array, float] | None:
    """Steps of the views (n,) and of the points (N, 3), and the fall of the cost that they promise."""
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    reduced = reduce(problem, linear, weights, damping)
    diagonal = np.maximum(reduced.U, 1e-300)
    S = reduced.S + np.diag(damping * diagonal)
    scale = 1.0 / np.sqrt(diagonal)
    try:
        factor = cho_factor(S * scale[:, None] * scale, lower=True, overwrite_a=True, check_finite=False)
    except LinAlgError:
        return None
    step = scale * cho_solve(factor, scale * reduced.g, check_finite=False)
    point_steps = follow(problem, linear, weights, reduced, step)
    promised = 0.5 * float(
        reduced.g @ step + np.einsum("ni,nij,nj->", reduced.b, reduced.T_inverse, reduced.b)
    )
    # the reduced right-hand side has taken the points' share: b'T⁻¹b is what they give alone
    return (step, point_steps, promised) if np.isfinite(promised) else None
