"""iSAM2 over all variables of a problem."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.checks import check_problem
from factorlab.graph.slam.feeding import Feed, Step
from factorlab.graph.slam.marginals import marginals
from factorlab.graph.slam.rows import Rows
from factorlab.graph.slam.sparse import solve_rows
from factorlab.graph.slam.variables import read_values
from factorlab.graph.slam.walking import ROUNDS, Walk, believer, isam_parameters
from factorlab.graph.solve import Solved, optimise, readable
from sequential.model import Loss
from sequential.slam import SlamProblem, SlamRun

__all__ = ["IncrementalSlam"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
SETTLING = 20  # Gauss-Newton steps after the last measurement, at most


@dataclass(frozen=True, slots=True)
class IncrementalSlam:
    """iSAM2 (Kaess et al. 2012), one update a step.

    Parameters
    ----------
    threshold : tangent step beyond which a variable is relinearised
    every : updates between two looks at what is to be relinearised
    final : end with Gauss-Newton over everything, from what was believed last: the batch's own optimum, where
        iSAM2 alone stays within `threshold` of where it was linearised
    loss : robust loss of groups that bring none of their own
    covariance : marginals at the end, of all kinds, of the named kinds, or none
    online : also the covariance of the newest pose at each step; it is not part of the reported seconds
    """

    threshold: float = 0.01
    every: int = 1
    final: bool = True
    loss: Loss | None = None
    covariance: bool | tuple[str, ...] = True
    online: bool = True

    @property
    def name(self) -> str:
        """`isam2`, or `isam2_final`."""
        return "isam2_final" if self.final else "isam2"

    def solve(self, problem: SlamProblem) -> SlamRun:
        """Feed, and read what is believed; raises `DataError`, `UnderConstrainedError`, `ModelError`."""
        index = {kind: known for kind in problem.kinds if len(known := problem.indices(kind))}
        check_problem(problem, index)
        began = time.perf_counter()
        engine = gtsam.ISAM2(isam_parameters(self.threshold, self.every))
        feed = Feed(problem, believer(problem, engine), engine.calculateEstimate, self.threshold, self.loss)
        walk = Walk(problem, feed, engine, online=self.online)
        walk.seconds = time.perf_counter() - began

        def update(step: Step) -> None:
            result = engine.update(step.graph, step.values, step.replaced)
            feed.entered(step, result.getNewFactorsIndices() if feed.containers else [])

        with readable():
            walk.run(update)
            began = time.perf_counter()
            solved = self._end(problem, feed, engine, update, index)
            walk.seconds += time.perf_counter() - began
        values, report = solved.values, walk.report(self.name, solved)
        covs = marginals(problem, values, asked=self.covariance, loss=self.loss)
        return SlamRun(values, covs, dict(problem.kinds), report, walk.online_run(report))

    def _end(
        self,
        problem: SlamProblem,
        feed: Feed,
        engine: Any,
        update: Callable[[Step], None],
        index: dict[str, Ints],
    ) -> Solved:
        """What is believed in the end, and where it is final what one more Gauss-Newton step promises."""
        if feed.containers is not None:
            for step in feed.again_linearised(ROUNDS):
                update(step)
        source, graph = engine.calculateEstimate(), engine.getFactorsUnsafe()
        if self.final and feed.containers is None:
            solved = optimise(graph, source, None, SETTLING, check=False)
            return replace(solved, values=read_values(problem, solved.values, index))
        values = read_values(problem, source, index)
        if self.final:
            return solve_rows(Rows(problem, index, self.loss), values, SETTLING)
        return Solved(values, float(graph.error(source)), 0, float("nan"))
