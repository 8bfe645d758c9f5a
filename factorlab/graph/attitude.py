"""The attitude smoother as a factor graph: the same nodes, model and weights, solved by GTSAM."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, final

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.keys import STATIC, X
from factorlab.graph.solve import readable
from sequential.attitude.history import AttitudeHistory
from sequential.attitude.smoother import AttitudeSmoother, attitude_history
from sequential.attitude.smoother_chain import AttitudeChain, ChainSolution
from sequential.attitude.smoother_cut import attitude_chain
from sequential.attitude.smoother_model import AttitudeModel
from sequential.sensors.recording import ImuRecording

__all__ = ["AttitudeGraph", "LinearAttitudeGraph"]

Array = NDArray[np.float64]
CERTAIN = 1e-8  # standard deviation of what the model holds to be known


@final
@dataclass(frozen=True, slots=True)
class AttitudeGraph:
    """`AttitudeSmoother` with GTSAM as its solver.

    Nodes are variables of ten directions (rotation, gyro bias, velocity, magnetic disturbance); delay,
    accelerometer bias and gyro matrix are one variable more, which every node touches.  Each node is one
    JacobianFactor, linearised by the compiled model, so no Python runs inside the optimiser and the cost is
    linear in the length of the recording.  The first trajectory is the extended filter's and its smoother's;
    covariances are those of the same normal equations, by one pass over the chain.

    Parameters
    ----------
    model, iterations, magnetometer : as of `AttitudeSmoother`
    """

    model: AttitudeModel = field(default_factory=AttitudeModel)
    iterations: int = 2
    magnetometer: bool | None = None

    def __post_init__(self) -> None:
        self._twin()

    @property
    def name(self) -> str:
        """attitude graph."""
        return "attitude graph"

    def _twin(self) -> AttitudeSmoother:
        return AttitudeSmoother(self.model, self.iterations, self.magnetometer)

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation at every sample, with covariance.

        Raises
        ------
        MissingStreamError, DataError, UnderConstrainedError
        """
        if self.magnetometer:
            recording.require("mag", si=False)
        chain = attitude_chain(recording, self.model, field=self.magnetometer is not False)
        chain, solution = self._twin().first_pass(chain)
        return attitude_history(recording, chain, self.solve(chain, solution), None, self.name)

    def estimate_many(
        self, recordings: Iterable[ImuRecording], threads: int | None = None
    ) -> list[AttitudeHistory]:
        """Every recording by `estimate`, one after the other: GTSAM brings its own threads, if any.

        `threads` is accepted so that estimators can be swapped.
        """
        return [self.estimate(one) for one in recordings]

    def solve(self, chain: AttitudeChain, about: ChainSolution) -> ChainSolution:
        """Gauss-Newton by GTSAM from a solution, the field weighed anew at each step."""
        solution = about
        weight = np.zeros(len(chain.nodes))
        for _ in range(self.iterations):
            if chain.field:
                weight = chain.weights(solution)
            graph = LinearAttitudeGraph(chain, solution, weight)
            solution = graph.moved()
        judged = chain.solve(solution, weight=weight)
        return judged._replace(rotation=solution.rotation, state=solution.state, trust=weight)


class LinearAttitudeGraph:
    """A chain linearised about a solution, as a `gtsam.GaussianFactorGraph`.

    Parameters
    ----------
    chain : nodes and model
    about : where to linearise
    weight : (K,) trust in the readings of the field
    """

    def __init__(self, chain: AttitudeChain, about: ChainSolution, weight: Array) -> None:
        from sequential.attitude.smoother_rows_kernel import MOVING, ROWS, whitened_rows
        from sequential.attitude.smoother_rows_kernel import STATIC as CONSTANTS

        count = len(chain.nodes) + 1
        self.rotation, self.state = np.array(about.rotation), np.array(about.state)
        self.state[:, MOVING:] = about.state[-1, MOVING:]
        before, here = np.empty((2, count, ROWS, MOVING))
        static, right = np.empty((count, ROWS, CONSTANTS)), np.empty((count, ROWS))
        whitened_rows(
            chain.nodes, chain.rest, np.ascontiguousarray(weight), chain.settings, chain.field,
            self.rotation, self.state, before, here, static, right,
        )  # fmt: skip
        self.keys = [X(k) for k in range(count)]
        self.graph = gtsam.GaussianFactorGraph()
        unit = gtsam.noiseModel.Unit.Create(ROWS)
        for k, key in enumerate(self.keys):
            last = (self.keys[k - 1], before[k]) if k else ()
            self.graph.push_back(gtsam.JacobianFactor(*last, key, here[k], STATIC, static[k], right[k], unit))
        self._prior(chain, MOVING)
        self.ordering = gtsam.Ordering()
        for key in (*self.keys, STATIC):
            self.ordering.push_back(key)

    def _prior(self, chain: AttitudeChain, moving: int) -> None:
        from sequential.attitude.smoother_steps_kernel import difference

        mean, turn = np.zeros(self.state.shape[1]), np.empty(3)
        difference(chain.beginning(self.rotation[0], field=chain.field), self.rotation[0], turn)
        mean[3:6] = chain.bias
        mean -= self.state[0]
        mean[:3] = turn
        sigma = np.maximum(CERTAIN, np.sqrt(np.diag(chain.model.prior(heading=chain.field))))
        for key, part in ((self.keys[0], slice(0, moving)), (STATIC, slice(moving, None))):
            unit = gtsam.noiseModel.Unit.Create(len(sigma[part]))
            rows = np.diag(1.0 / sigma[part])
            self.graph.push_back(gtsam.JacobianFactor(key, rows, mean[part] / sigma[part], unit))

    def moved(self) -> ChainSolution:
        """Solve, and go there; without covariances.

        Raises
        ------
        UnderConstrainedError
        """
        from sequential.attitude.smoother_rows_kernel import MOVING, move

        with readable():
            solution = self.graph.optimize(self.ordering)
        deviation = solution.vector(self.keys).reshape(len(self.keys), MOVING)
        rotation, state = self.rotation.copy(), self.state.copy()
        move(rotation, state, np.ascontiguousarray(deviation), solution.at(STATIC))
        none = np.zeros((0, 0, 0))
        return ChainSolution(rotation, state, none, none, np.zeros((0, 0)), np.zeros(0))

    def marginals(self, k: int) -> Any:
        """(6, 6) covariance of rotation (in the world) and gyro bias of node k, by GTSAM.

        For a look at single nodes: each one eliminates the chain anew.
        """
        order = gtsam.Ordering()
        for key in (*(key for key in self.keys if key != self.keys[k]), STATIC, self.keys[k]):
            order.push_back(key)
        tree = self.graph.eliminateSequential(order)
        root = tree.at(tree.size() - 1)
        upper = root.R()
        return np.linalg.inv(upper.T @ upper)[:6, :6]
