"""The chain of nodes that the attitude smoothers solve, and its solution by filtering and smoothing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.attitude.smoother_model import AttitudeModel

__all__ = ["AttitudeChain", "ChainSamples", "ChainSolution", "integrate"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
SIZE, MOVING = 23, 10
LONGEST_FIELD = 1.0  # s that one reading of a slow magnetometer stands for


class ChainSolution(NamedTuple):
    """K + 1 nodes."""

    rotation: Array  # (K + 1, 3, 3) body to world
    state: Array  # (K + 1, 23), the first three zero
    cov: Array  # (K + 1, 6, 6) of rotation (in the world) and gyro bias
    filtered: Array  # (K + 1, 23, 23) covariance on the way there
    start_cov: Array  # (23, 23) of the first node
    trust: Array  # (K,) of the field in this solution, 0 to 1


class ChainSamples(NamedTuple):
    """What a recording gives the nodes: N samples."""

    dt: Array  # (N,) time that each one is integrated over, s
    lost: Array  # (N,) what a gap before it leaves unknown, s
    gyro: Array  # (N, 3)
    accel: Array  # (N, 3)
    mag: Array  # (N, 3) in units of the usual norm; NaN where there is no reading


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeChain:
    """Preintegrated nodes with everything that a solver needs.

    Parameters
    ----------
    model : noises
    samples : that the nodes were made of
    first : (K + 1,) first sample of each node, and N
    nodes : (K, 66), columns of `smoother_nodes_kernel`
    reference : (3,) gyro bias that they were integrated with
    rest : (K,)
    bias : (3,) guess of the gyro's bias, to begin with
    start : (3, 3) rotation, to begin with
    fresh : (K, 3, 3) rotation after nodes that end a long gap; NaN elsewhere
    field : whether there is a magnetometer
    """

    model: AttitudeModel
    samples: ChainSamples
    first: NDArray[np.int64]
    nodes: Array
    reference: Array
    rest: Flags
    bias: Array
    start: Array
    fresh: Array
    field: bool

    @property
    def settings(self) -> Array:
        """(18,) what the compiled loops take."""
        return np.concatenate([self.model.settings(), self.reference])

    def integrated(self, bias: Array) -> AttitudeChain:
        """The same chain, its nodes integrated with another gyro bias (3,)."""
        return replace(self, nodes=integrate(self.samples, self.first, bias), reference=bias)

    def solve(
        self,
        around: ChainSolution | None = None,
        *,
        weight: Array | None = None,
        field: bool = True,
        covariance: bool = True,
        hindsight: bool = True,
    ) -> ChainSolution:
        """Filter forwards, smooth backwards, about a solution or else about the filter's own estimate.

        Parameters
        ----------
        weight : (K,) of the readings of the field
        field : use the magnetometer
        covariance : also of the smoothed states
        hindsight : smooth; else each node is as the filter left it, which takes no trajectory to go around
        """
        from sequential.attitude.smoother_backward_kernel import backward
        from sequential.attitude.smoother_forward_kernel import forward

        count, field = len(self.nodes), field and self.field
        rotation, state = np.empty((count + 1, 3, 3)), np.empty((count + 1, SIZE))
        if around is not None:
            rotation[:], state[:] = around.rotation, around.state
            state[:, MOVING:] = around.state[-1, MOVING:]
        start = self.start if around is None else self.beginning(rotation[0], field=field)
        prior = np.zeros(SIZE)
        prior[3:6] = self.bias
        deviation, cov = np.empty((count + 1, SIZE)), np.empty((count + 1, SIZE, SIZE))
        gains = np.empty((count, 7, SIZE + 2))
        by_gyro, by_push = np.empty((count, 3, 12)), np.empty((count, 3, 6))
        rows, trust = np.zeros((count, 5)), np.ones(count)
        given = np.ones(count) if weight is None else np.ascontiguousarray(weight)
        settings, start_cov = self.settings, self.model.prior(heading=field)
        forward(
            self.nodes, self.rest, given, self.fresh, settings, start, prior, start_cov, field,
            around is not None, rotation, state, deviation, cov, gains, by_gyro, by_push, rows, trust,
        )  # fmt: skip
        smoothed, end = cov[:, :6, :6].copy(), np.zeros((SIZE, SIZE))
        if hindsight:
            backward(
                self.nodes, self.rest, settings, gains, by_gyro, by_push, rows, covariance, rotation, state,
                deviation, cov, smoothed, end,
            )  # fmt: skip
        return ChainSolution(rotation, state, smoothed, cov, end, given * trust if field else np.zeros(count))

    def beginning(self, rotation: Array, *, field: bool) -> Array:
        """(3, 3) mean of the prior, for a pass about a trajectory that begins with `rotation`.

        Without a field the heading at the start is a choice; that of the trajectory is kept.
        """
        if field:
            return self.start
        ahead, own = rotation @ self.start.T, self.start
        angle = np.arctan2(ahead[1, 0] - ahead[0, 1], ahead[0, 0] + ahead[1, 1])
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ own

    def weights(self, solution: ChainSolution) -> Array:
        """(K,) trust in each reading of the field, judged with a solution in hand (Geman and McClure).

        A reading is off by what it misses of the field that most others show, in all three directions: a
        magnet nearby bends strength and dip as well as heading.
        """
        from sequential.attitude.smoother_nodes_kernel import FIELD, FIELD_TIME, SWEEP

        seen = self.nodes[:, FIELD_TIME] > 0
        body = (
            self.nodes[:, FIELD : FIELD + 3] - solution.state[:-1, 10:11] * self.nodes[:, SWEEP : SWEEP + 3]
        )
        world = np.einsum("kij,kj->ki", solution.rotation[:-1], body)
        length = np.hypot(world[:, 0], world[:, 1])
        off = np.column_stack([length * np.arctan2(world[:, 0], world[:, 1]), length, world[:, 2]])
        off[:, 0] -= solution.state[:-1, 9]
        if seen.any():
            off[:, 1:] -= np.median(off[seen, 1:], axis=0)
        square = np.sum(off**2, axis=1) / self.model.mag_scatter**2
        return np.where(seen, 1.0 / (1.0 + square) ** 2, 0.0)

    def first_weights(self) -> Array:
        """(K,) trust before there is a solution: by the strength of the field alone."""
        from sequential.attitude.smoother_nodes_kernel import FIELD, FIELD_TIME

        norm = np.linalg.norm(self.nodes[:, FIELD : FIELD + 3], axis=1)
        square = ((norm - 1.0) / self.model.mag_scatter) ** 2
        return np.where(self.nodes[:, FIELD_TIME] > 0, 1.0 / (1.0 + square) ** 2, 0.0)


def integrate(samples: ChainSamples, first: NDArray[np.int64], bias: Array) -> Array:
    """(K, 66) nodes of samples, with a bias (3,) taken off the gyro."""
    from sequential.attitude.smoother_nodes_kernel import WIDTH, summarise

    nodes = np.empty((len(first) - 1, WIDTH))
    summarise(*samples, first, np.ascontiguousarray(bias), LONGEST_FIELD, nodes)
    return nodes
