"""An online smoother: the last few seconds of the chain are solved anew at every node.

Each node is estimated twice: when it is the newest, from what came before, and when it leaves the window,
`lag` seconds late, from what came since as well.  At lag zero both are the (iterated) filter's estimate; as
the lag grows the late one becomes the batch's.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.filters.solution import require_finite
from sequential.history import Report, Run
from sequential.smoothers.chain import ChainPass
from sequential.smoothers.online import predicted_innovations
from sequential.timeline import Problem, Schedule

__all__ = ["FixedLagSmoother"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FixedLagSmoother:
    """Gauss-Newton on a window of the chain; what leaves the window lives on as the window's prior.

    Takes any model, and gives the online estimate: what is known at each node when its readings arrive, or
    with `delayed` what is known when it leaves the window.  With a lag longer than the log it is the batch,
    solved again at every node.

    Parameters
    ----------
    lag : length of the window, s; infinity keeps everything, at a cost that grows with the square of the log
    max_iterations, tolerance : of Gauss-Newton in each window; the tolerance is in standard deviations
    delayed : estimate each node as it leaves the window, not as it enters
    """

    lag: float = 5.5
    max_iterations: int = 10
    tolerance: float = 1e-3
    delayed: bool = False
    name = "fixed_lag"

    def solve(self, problem: Problem) -> Run:
        """Online or delayed estimate at each node."""
        return self.solve_both(problem)[self.delayed]

    def solve_both(self, problem: Problem) -> tuple[Run, Run]:
        """Online and delayed estimate of one pass; `details` say how large a window got, and how slow."""
        began = time.perf_counter()
        window = _Window(problem)
        nodes, model = len(problem.t), problem.model
        d = model.manifold.dim
        newest, late = (_Estimates(nodes, model.manifold.size, d) for _ in range(2))
        oldest = np.searchsorted(problem.t, problem.t - self._lag_ns(problem))
        slowest, widest, left = 0.0, 1, 0
        for k in range(nodes):
            entered = time.perf_counter()
            window.grow(k, int(oldest[k]))
            window.settle(self.max_iterations, self.tolerance)
            slowest, widest = max(slowest, time.perf_counter() - entered), max(widest, k + 1 - window.first)
            newest.take(window, k, k + 1)
            leaving = nodes if k + 1 == nodes else min(int(oldest[k + 1]), k + 1)
            late.take(window, left, leaving)
            left = max(left, leaving)
        require_finite(problem, newest.mean)
        seconds = time.perf_counter() - began
        details = {"widest_window": float(widest), "slowest_update_s": slowest}
        report = Report(
            self.name,
            iterations=window.solves,
            seconds=seconds,
            message=window.whole.message(),
            details=details,
        )
        told = (problem.t, newest.mean, newest.cov, model.manifold)
        online = Run(*told, predicted_innovations(problem, newest.mean, newest.cov), float("nan"), report)
        return online, Run(problem.t, late.mean, late.cov, model.manifold, {}, float("nan"), report)

    def _lag_ns(self, problem: Problem) -> int:
        whole = int(problem.t[-1] - problem.t[0]) + 1
        return whole if self.lag * 1e9 >= whole else round(self.lag * 1e9)


class _Estimates:
    """Means and covariances of all nodes, filled from windows."""

    def __init__(self, nodes: int, n: int, d: int) -> None:
        self.mean, self.cov = np.empty((nodes, n)), np.empty((nodes, d, d))

    def take(self, window: _Window, first: int, last: int) -> None:
        """What a window says of nodes first..last-1."""
        if last > first:
            self.mean[first:last] = window.states[first:last]
            self.cov[first:last] = window.chain.cov[first - window.first : last - window.first]


class _Window:
    """Nodes first..last of a problem, with the belief about node `first` from all that came before it."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.whole = problem, compiled(problem.model)
        self.first = self.last = self.solves = 0
        self.prior_mean, self.prior_cov = problem.model.prior.mean, problem.model.prior.cov
        self.states = np.tile(self.prior_mean, (len(problem.t), 1))
        self.chain = ChainPass(problem, self.plan(0, 0))
        self.about = self.states[:1]

    def plan(self, first: int, last: int) -> Schedule:
        """The schedule of some nodes: pointers are cut, what they point at stays."""
        plan, span = self.problem.schedule, slice(first, last + 2)
        return plan._replace(step_ptr=plan.step_ptr[span], reading_ptr=plan.reading_ptr[span])

    def grow(self, node: int, oldest: int) -> None:
        """Let a node in, where the one before it leads, and let those before `oldest` go."""
        from sequential.kernels.walking import walk

        if node > 0:
            n, d = self.whole.tables.n, self.whole.tables.d
            arrived, square = np.empty((2, n)), np.empty((2, d, d))
            walk(
                self.whole.tables, self.plan(node - 1, node), self.states[node - 1 : node + 1],
                arrived, square, np.empty((2, d, d)),
            )  # fmt: skip
            self.states[node] = arrived[1]
        if (leaving := min(oldest, self.last) - self.first) > 0:
            self._hand_over(leaving)
        self.last = node

    def _hand_over(self, leaving: int) -> None:
        """Make the belief that some nodes leave behind the prior of the next one, in its own tangent."""
        manifold, forward = self.problem.model.manifold, self.chain.forward
        self.prior_mean = manifold.retract(self.about[leaving], forward.predicted_mean[leaving])
        _, inverse = manifold.transport(self.about[leaving], self.prior_mean)
        self.prior_cov = inverse @ forward.predicted_cov[leaving] @ inverse.T
        self.first += leaving

    def settle(self, max_iterations: int, tolerance: float) -> None:
        """Gauss-Newton over the window."""
        prior, inside = (self.prior_mean, self.prior_cov), slice(self.first, self.last + 1)
        self.chain = ChainPass(self.problem, self.plan(self.first, self.last))
        for _ in range(max_iterations):
            self.about = self.states[inside].copy()
            self.chain.solve(*prior, self.about)
            self.states[inside] = self.problem.model.manifold.retract(self.about, self.chain.step)
            self.solves += 1
            if self.chain.largest() <= tolerance:
                return
