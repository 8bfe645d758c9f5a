"""What a problem looks like in GTSAM's own variables and factors, and who can look like that.

`native_graph(problem)` gives a `NativeGraph` where every piece of the model has a C++ factor, else None:
the batched route then takes the problem.  New processes and sensors register themselves.
"""

from __future__ import annotations

import abc
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.model import Loss, ProcessModel
from sequential.timeline import Problem

__all__ = ["NativeGraph", "native_graph", "native_process", "noise_model"]

Array = NDArray[np.float64]


class NativeGraph(abc.ABC):
    """One problem in native variables; `k` counts nodes, `x` is our flat state (n,)."""

    incremental = True  # whether GTSAM's engines, one Gauss-Newton step an update, keep up with it

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    @abc.abstractmethod
    def keys(self, k: int) -> list[int]:
        """Variables of node k, without the static ones."""

    @abc.abstractmethod
    def shared_keys(self) -> list[int]:
        """Static variables and landmarks: those that belong to no node."""

    @abc.abstractmethod
    def insert(self, values: Any, k: int, x: Array) -> None:
        """Put a node's state into `gtsam.Values`."""

    @abc.abstractmethod
    def insert_shared(self, values: Any, x: Array) -> None:
        """Put the static parts and the landmarks into `gtsam.Values`."""

    @abc.abstractmethod
    def prior_factors(self) -> list[Any]:
        """The prior, and what holds landmarks in place."""

    @abc.abstractmethod
    def move(self, k: int, x: Array) -> tuple[list[Any], Array]:
        """Factors between nodes k-1 and k, given a guess of the state at k-1; and where it leads."""

    @abc.abstractmethod
    def reading_factors(self, k: int) -> list[Any]:
        """Factors of the readings at node k."""

    @abc.abstractmethod
    def read(self, source: Any, k: int) -> Array:
        """State of node k (n,) from anything with `atPose2`-like or `calculateEstimate…` methods."""

    @abc.abstractmethod
    def covariance(self, source: Any, k: int, x: Array) -> Array:
        """(d, d) in our chart, from `Marginals`, an iSAM2 or a fixed-lag smoother."""

    def covariances(self, graph: Any, values: Any, mean: Array) -> Array:
        """(K, d, d) of all nodes, given the graph solved at `values`, which are `mean` (K, n)."""
        import gtsam

        marginals = gtsam.Marginals(graph, values)
        return np.stack([self.covariance(marginals, k, x) for k, x in enumerate(mean)])


@singledispatch
def native_process(process: ProcessModel, problem: Problem) -> NativeGraph | None:
    """The native graph of a process, or None."""
    return None


def native_graph(problem: Problem) -> NativeGraph | None:
    """The problem in native factors, or None where a piece has none."""
    # The rooms register themselves when imported.
    import factorlab.graph.factors.inertial
    import factorlab.graph.factors.planar
    import factorlab.graph.factors.spatial  # noqa: F401

    # missing components and noises of single readings have no place in a native factor
    return native_process(problem.model.process, problem) if problem.plain else None


def noise_model(cov: ArrayLike, loss: Loss | None = None) -> Any:
    """GTSAM's noise model of a covariance, wrapped in a robust loss where there is one."""
    import gtsam

    model = gtsam.noiseModel.Gaussian.Covariance(np.asarray(cov))
    if loss is None:
        return model
    estimator = {"huber": gtsam.noiseModel.mEstimator.Huber, "cauchy": gtsam.noiseModel.mEstimator.Cauchy}
    return gtsam.noiseModel.Robust.Create(estimator[loss.kind].Create(loss.k), model)


def joint_blocks(source: Any, keys: list[int]) -> Array:
    """Joint covariance of some variables, in the order of `keys`."""
    # A fixed-lag smoother answers for single variables only; the tree inside it knows them together.
    tree = source.getISAM2() if hasattr(source, "getISAM2") else source
    joint = tree.jointMarginalCovariance(keys)
    return np.block([[joint.at(a, b) for b in keys] for a in keys])
