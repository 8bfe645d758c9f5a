"""Least squares over a trajectory and a calibration: Levenberg-Marquardt, who is believed, and the noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import UnderConstrainedError
from vision3d.inertial.banded import ArrowSystem, Solved
from vision3d.inertial.problem import Linear, Problem
from vision3d.inertial.state import State

__all__ = ["Adjusted", "BiasWalk", "adjust", "freedoms", "normal_equations"]

Array = NDArray[np.float64]
SETTLED = 1e-3  # Newton decrement, in units of the cost's own noise: far below any standard deviation
MOST_DAMPING = 1e8


@dataclass(frozen=True)
class BiasWalk:
    """How biases may change: rad/s²/√Hz and m/s³/√Hz."""

    gyro: float
    accel: float

    def prior(self, state: State, constants: int) -> tuple[Array, Array, float]:
        """Information, gradient and cost of the steps between nodes, over constants and nodes."""
        nodes = len(state.gyro_bias)
        sigma = np.repeat([self.gyro, self.accel], 3) * np.sqrt(state.grid.node_step_s)
        values = np.hstack([state.gyro_bias, state.accel_bias])
        difference = np.diff(np.eye(nodes), axis=0)
        size = constants + 6 * nodes
        H, g = np.zeros((size, size)), np.zeros(size)
        H[constants:, constants:] = np.kron(difference.T @ difference, np.diag(sigma**-2.0))
        g[constants:] = H[constants:, constants:] @ values.ravel()
        return H, g, 0.5 * float(values.ravel() @ g[constants:])


@dataclass(frozen=True, eq=False)
class Adjusted:
    """Where least squares ended.

    Parameters
    ----------
    state, linear, system : the state, its residuals, its normal equations (factored)
    cost : half the weighted sum of squares
    iterations : steps tried
    decrement : of the last step, in units of cost
    settled : whether the last step was small
    """

    state: State
    linear: Linear
    system: ArrowSystem
    cost: float
    iterations: int
    decrement: float
    settled: bool


def normal_equations(problem: Problem, state: State, linear: Linear, walk: BiasWalk) -> ArrowSystem:
    """The system of a state."""
    system = ArrowSystem(state.grid.count, problem.constants.count, state.grid.nodes, state.grid.order)
    for rows in (linear.gyro, linear.accel, linear.frames):
        system.add(rows)
    H, g, _ = walk.prior(state, problem.constants.count)
    system.add_border(H, g)
    return system


def adjust(problem: Problem, state: State, walk: BiasWalk, *, iterations: int = 30) -> Adjusted:
    """Levenberg-Marquardt from a state.

    Raises
    ------
    UnderConstrainedError
        where the readings leave something free.
    """
    count = problem.constants.count
    linear = problem.linear(state)
    cost = linear.cost + walk.prior(state, count)[2]
    system = normal_equations(problem, state, linear, walk)
    damping, decrement, tried = 0.0, np.inf, 0
    while tried < iterations:
        tried += 1
        step = _step(system, damping)
        decrement = -_inner(step, system)
        if decrement < SETTLED:
            break
        ahead = state.moved(step, problem.constants)
        trial = problem.linear(ahead)
        after = trial.cost + walk.prior(ahead, count)[2]
        if np.isfinite(after) and after <= cost + 1e-9 * abs(cost):
            state, linear, cost = ahead, trial, after
            damping = 0.0 if damping < 1e-9 else damping / 10.0
            system = normal_equations(problem, state, linear, walk)
            continue
        damping = max(1e-6, 10.0 * damping)
        if damping > MOST_DAMPING:
            break
    system.factor()
    return Adjusted(state, linear, system, cost, tried, decrement, decrement < SETTLED)


def _step(system: ArrowSystem, damping: float) -> Solved:
    """The step, damped more where the matrix is not positive definite."""
    while True:
        try:
            system.factor(damping)
            return system.solve()
        except UnderConstrainedError:
            damping = max(1e-8, 100.0 * damping)
            if damping > MOST_DAMPING:
                raise


def _inner(step: Solved, system: ArrowSystem) -> float:
    border = np.concatenate([step.constants, step.nodes.ravel()])
    return float(np.sum(step.controls * system.g_knots) + border @ system.g_border)


def freedoms(adjusted: Adjusted, *, probes: int = 6, seed: int = 0) -> tuple[float, float, float]:
    """How many numbers of gyro, accelerometer and corners the unknowns use up.

    The trace of the hat matrix of each group, by random signs (Hutchinson 1990): residuals of N scatter
    like those of N less so many.
    """
    system, rng = adjusted.system, np.random.default_rng(seed)
    used = []
    for rows in (adjusted.linear.gyro, adjusted.linear.accel, adjusted.linear.frames):
        total = 0.0
        for _ in range(probes):
            signs = rng.choice([-1.0, 1.0], size=rows.e.shape)
            own = ArrowSystem(system.knots, system.constants, system.nodes, system.order)
            root = np.sqrt(rows.weight)[:, None]
            probe = replace(rows, e=np.where(root > 0.0, signs / np.where(root > 0.0, root, 1.0), 0.0))
            own.add_gradient(probe)
            step = system.solve(own.g_knots, own.g_border)
            total -= float(
                np.sum(signs * root * rows.applied(step.controls, step.constants, step.nodes, system.order))
            )
        used.append(total / probes)
    return used[0], used[1], used[2]
