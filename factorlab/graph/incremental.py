"""Online graphs: iSAM2, and a fixed lag on top of it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.native import NativeGraph, native_graph
from factorlab.graph.solve import readable
from sequential.errors import ModelError
from sequential.history import Report, Run
from sequential.smoothers import FixedLagSmoother
from sequential.smoothers.leave_one_out import leave_one_out
from sequential.smoothers.online import predicted_innovations
from sequential.timeline import Problem

__all__ = ["FixedLagGraph", "IncrementalGraph"]

Array = NDArray[np.float64]


NOT_NATIVE = "no native factors: the windows were solved by the chain solver"
NOT_ONE_STEP = "one step an update is too few for these factors: the chain solver settled each window"


def isam_parameters(threshold: float) -> Any:
    """Relinearise at every update whatever moved by more than `threshold`."""
    parameters = gtsam.ISAM2Params()
    parameters.relinearizeSkip = 1
    parameters.setRelinearizeThreshold(threshold)
    return parameters


def require_native(problem: Problem, name: str) -> NativeGraph:
    """The native graph, or a sentence."""
    native = native_graph(problem)
    if native is None:
        msg = (
            f"{name} needs native GTSAM factors, which this model's process or sensors do not have; "
            "use FixedLagGraph(), BatchGraph() or IteratedSmoother()"
        )
        raise ModelError(msg)
    if not native.incremental:
        msg = (
            f"{name} takes one Gauss-Newton step an update, which loses track of these factors; use "
            "FixedLagGraph(), BatchGraph() or IteratedSmoother()"
        )
        raise ModelError(msg)
    return native


@dataclass(frozen=True, slots=True)
class IncrementalGraph:
    """iSAM2 (Kaess et al. 2012), one update a node.

    Parameters
    ----------
    final : give the smoothed estimate after the last update instead of the online one at each node
    threshold : tangent step beyond which a variable is relinearised
    """

    final: bool = False
    threshold: float = 0.01

    @property
    def name(self) -> str:
        """`isam2`, or `isam2_final`."""
        return "isam2_final" if self.final else "isam2"

    def solve(self, problem: Problem) -> Run:
        """The online or the final estimate."""
        online, final = self.solve_both(problem)
        return final if self.final else online

    def solve_both(self, problem: Problem) -> tuple[Run, Run]:
        """Online and final estimate of one pass."""
        native = require_native(problem, "iSAM2")
        engine = gtsam.ISAM2(isam_parameters(self.threshold))
        mean, cov, seconds = walk(
            problem, native, lambda graph, values, _: engine.update(graph, values), engine
        )
        online = online_run(problem, mean, cov, "isam2", seconds)
        began = time.perf_counter()
        for _ in range(5):
            engine.update()
        values = engine.calculateEstimate()
        seconds += time.perf_counter() - began
        last = np.stack([native.read(values, k) for k in range(len(problem.t))])
        spread = native.covariances(engine.getFactorsUnsafe(), values, last)
        report = Report("isam2_final", iterations=len(problem.t), seconds=seconds)
        final = Run(problem.t, last, spread, problem.model.manifold, {}, float("nan"), report)
        return online, replace(final, innovations=leave_one_out(problem, final))


@dataclass(frozen=True, slots=True)
class FixedLagGraph:
    """The last `lag` seconds as a graph; gtsam's IncrementalFixedLagSmoother marginalises what is older.

    A model without native factors goes to `sequential.FixedLagSmoother`, which solves the same windows.

    Parameters
    ----------
    lag : s
    threshold : tangent step beyond which a variable is relinearised
    """

    lag: float = 5.5
    threshold: float = 0.01
    name = "fixed_lag"

    def solve(self, problem: Problem) -> Run:
        """Online estimate at each node."""
        native = native_graph(problem)
        if native is None or not native.incremental:
            run = FixedLagSmoother(self.lag).solve(problem)
            reason = NOT_NATIVE if native is None else NOT_ONE_STEP
            return replace(run, report=replace(run.report, message=reason))
        engine = gtsam.IncrementalFixedLagSmoother(self.lag, isam_parameters(self.threshold))
        mean, cov, seconds = walk(problem, native, engine.update, engine, stamped=True)
        return online_run(problem, mean, cov, self.name, seconds)


def online_run(problem: Problem, mean: Array, cov: Array, name: str, seconds: float) -> Run:
    """The `Run` of an online engine, with the innovations of a filter."""
    report = Report(name, iterations=len(mean), seconds=seconds)
    innovations = predicted_innovations(problem, mean, cov)
    return Run(problem.t, mean, cov, problem.model.manifold, innovations, float("nan"), report)


def walk(
    problem: Problem,
    native: NativeGraph,
    update: Any,
    engine: Any,
    *,
    stamped: bool = False,
) -> tuple[Array, Array, float]:
    """Feed an engine node by node; the seconds leave out the marginals."""
    mean, cov, seconds = [], [], 0.0
    t = ((problem.t - problem.t[0]) * 1e-9).tolist()
    x = np.array(problem.model.prior.mean)
    with readable(problem):
        for k in range(len(t)):
            began = time.perf_counter()
            graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
            if k == 0:
                native.insert_shared(values, x)
                factors = native.prior_factors()
            else:
                factors, x = native.move(k, x)
            native.insert(values, k, x)
            for factor in factors + native.reading_factors(k):
                graph.add(factor)
            keys = native.keys(k)
            # A static variable gets the newest stamp again and again, so that it never leaves the window.
            update(graph, values, dict.fromkeys([*keys, *native.shared_keys()], t[k]) if stamped else None)
            x = native.read(engine, k)
            seconds += time.perf_counter() - began
            mean.append(x)
            cov.append(native.covariance(engine, k, x))
    return np.stack(mean), np.stack(cov), seconds
