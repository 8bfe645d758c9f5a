"""Where markers are and how the camera moved: corners of markers and an IMU in one problem.

Unknown are the pose of every marker, of the body at every frame, and with an IMU its velocity and biases.
Corners enter with the whole covariance of a sighting through any lens (`marker_rows`); between frames stand
GTSAM's native factors (`marker_inertial`); the normal equations are a chain with a border (`bordered_chain`).

The gauge is held, not weighed: without an IMU the reference marker does not move, with one its place and its
heading about the vertical do not.  Covariances are relative to it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.bordered_chain import BorderedChain
from factorlab.graph.marker_inertial import InertialLinks
from factorlab.graph.marker_rows import CornerRows
from factorlab.graph.solve import ENOUGH, SETTLED
from sequential.errors import NotConvergedError
from sequential.manifold import SE3, rotation_matrix
from vision3d.markers.sightings import MarkerSightings

__all__ = ["MapCovariance", "MapSolved", "MapState", "MarkerMapGraph"]

Array = NDArray[np.float64]
CAUCHY = 6.0  # norm of eight whitened numbers beyond which a sighting loses weight; 2.8 is usual
LEAST = 1e-6  # information of a velocity, s²/m², that no IMU tells
MANIFOLD = SE3()


@dataclass(frozen=True, eq=False)
class MapState:
    """Values of all variables.

    Parameters
    ----------
    frames : (F, 7) world_T_body
    markers : (M, 7) world_T_marker
    velocities : (F, 3) m/s in the world, or None
    biases : (F, 6) accelerometer m/s², gyro rad/s, or None
    """

    frames: Array
    markers: Array
    velocities: Array | None = None
    biases: Array | None = None

    @property
    def motion(self) -> tuple[Array, Array, Array]:
        """Poses, velocities and biases of an inertial problem."""
        assert self.velocities is not None and self.biases is not None  # noqa: S101, PT018
        return self.frames, self.velocities, self.biases

    def moved(self, chain: Array, border: Array) -> MapState:
        """Step by (F, 6 or 15) and (M, 6)."""
        frames = MANIFOLD.retract(self.frames, chain[:, :6])
        markers = MANIFOLD.retract(self.markers, border)
        if self.velocities is None or self.biases is None:
            return MapState(frames, markers)
        return MapState(frames, markers, self.velocities + chain[:, 6:9], self.biases + chain[:, 9:])


@dataclass(frozen=True, eq=False)
class MapCovariance:
    """Marginals (F, 6 or 15) of frames, and the joint (6 M, 6 M) of markers; the gauge is held."""

    frames: Array
    markers: Array

    def marker(self, row: int) -> Array:
        """(6, 6) of one marker relative to the reference."""
        return self.markers[6 * row : 6 * row + 6, 6 * row : 6 * row + 6]


@dataclass(frozen=True, eq=False)
class MapSolved:
    """Values at the optimum and how they were reached."""

    state: MapState
    cost: float
    iterations: int
    decrement: float

    @property
    def settled(self) -> bool:
        """Whether one more step promises next to nothing."""
        return self.decrement <= SETTLED * (1.0 + self.cost)


@dataclass(frozen=True, eq=False)
class MarkerMapGraph:
    """The problem.

    Parameters
    ----------
    sightings : each marker at most once a frame
    body_T_camera : (7,)
    reference : row of the marker that holds the gauge
    inertial : factors between frames, or None
    bias_sigmas : standard deviations of the first frame's biases about zero: accelerometer m/s², gyro rad/s
    robust : weigh sightings by Cauchy's loss
    """

    sightings: MarkerSightings
    body_T_camera: Array
    reference: int = 0
    inertial: InertialLinks | None = None
    bias_sigmas: tuple[float, float] = (0.5, 0.05)
    robust: bool = False
    rows: CornerRows = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", CornerRows.of(self.sightings, self.body_T_camera))

    def solve(self, start: MapState, max_iterations: int = 60, *, check: bool = True) -> MapSolved:
        """Levenberg-Marquardt; the preintegration is made anew where biases have moved.

        Raises
        ------
        UnderConstrainedError, NotConvergedError
        """
        state, steps = start, 0
        while True:
            native = None if self.inertial is None else self.inertial.about(state.motion[2])
            before = state
            solved = self._descend(state, native, max_iterations - steps)
            state, steps = solved.state, steps + solved.iterations
            if self.inertial is None or steps >= max_iterations:
                break
            if np.abs(state.motion[2] - before.motion[2]).max() < 1e-5:
                break
        solved = replace(solved, iterations=steps)
        if check and not solved.settled:
            raise NotConvergedError(
                f"the marker map stopped after {steps} iterations at cost {solved.cost:.6g}, and one more "
                f"step would take off {solved.decrement:.3g}; its start is poor, or measurements contradict"
            )
        return solved

    def _descend(self, state: MapState, native: Any, most: int) -> MapSolved:
        damping, cost, decrement, steps = 1e-5, self.cost(state, native), np.inf, 0
        while steps < max(most, 1):
            problem, basis = self._linearised(state, native)
            decrement, taken = np.inf, False
            for _ in range(12):
                solution = problem.damped(damping).solve()
                promised = -0.5 * float(
                    np.sum(problem.gradient * solution.chain) + problem.border_gradient @ solution.border
                )
                decrement = min(decrement, promised)
                trial = state.moved(solution.chain, (basis @ solution.border).reshape(-1, 6))
                after = self.cost(trial, native)
                if after <= cost * (1.0 + 1e-12):
                    state, cost, taken = trial, after, True
                    damping = max(damping * 0.1, 1e-12)
                    break
                damping *= 10.0
            steps += 1
            if not taken or decrement <= ENOUGH * (1.0 + cost):
                break
        return MapSolved(state, cost, steps, decrement)

    def chi2(self, state: MapState) -> Array:
        """(S,) squared norm of the whitened errors of each sighting."""
        error = self.rows.errors(*self._seen(state))
        squared: Array = np.einsum("si,si->s", error, error)
        return squared

    def cost(self, state: MapState, native: Any = None) -> float:
        """Half the sum of squares, or of Cauchy's loss of sightings."""
        squared = self.chi2(state)
        if self.robust:
            squared = CAUCHY**2 * np.log1p(squared / CAUCHY**2)
        cost = 0.5 * float(squared.sum())
        if self.inertial is not None:
            cost += self.inertial.cost(native, *state.motion)
            cost += 0.5 * float(np.sum((state.motion[2][0] / self._bias_scale()) ** 2))
        return cost

    def covariance(self, state: MapState) -> MapCovariance:
        """Marginals at a solution, the loss's weights taken there.

        Raises
        ------
        UnderConstrainedError
        """
        native = None if self.inertial is None else self.inertial.about(state.motion[2])
        problem, basis = self._linearised(state, native)
        frames, border = problem.solve().covariances()
        return MapCovariance(frames, basis @ border @ basis.T)

    def _seen(self, state: MapState) -> tuple[Array, Array]:
        return state.frames[self.sightings.frame], state.markers[self.sightings.marker]

    def _bias_scale(self) -> Array:
        return np.repeat(self.bias_sigmas, 3)

    def _linearised(self, state: MapState, native: Any) -> tuple[BorderedChain, Array]:
        """Normal equations, and the basis (6 M, q) of the steps that markers may take."""
        frame, marker = self.sightings.frame, self.sightings.marker
        error, by_frame, by_marker = self.rows.linearised(*self._seen(state))
        if self.robust:
            weight = 1.0 / np.sqrt(1.0 + np.einsum("si,si->s", error, error) / CAUCHY**2)
            error, by_frame, by_marker = (
                rows * weight.reshape(-1, *[1] * (rows.ndim - 1)) for rows in (error, by_frame, by_marker)
            )
        count, m, n = len(state.frames), len(state.markers), 6 if self.inertial is None else 15
        D, g = np.zeros((count, n, n)), np.zeros((count, n))
        E = np.zeros((count, n, m, 6))
        C, b = np.zeros((m, 6, m, 6)), np.zeros((m, 6))
        turned, turned_marker = by_frame.transpose(0, 2, 1), by_marker.transpose(0, 2, 1)
        D[:, :6, :6] = _summed(turned @ by_frame, frame, count)
        g[:, :6] = _summed((turned @ error[..., None])[..., 0], frame, count)
        E[:, :6].transpose(0, 2, 1, 3)[frame, marker] = turned @ by_marker
        C[np.arange(m), :, np.arange(m)] = _summed(turned_marker @ by_marker, marker, m)
        b[:] = _summed((turned_marker @ error[..., None])[..., 0], marker, m)
        beside = None if self.inertial is None else self._link(state, native, D, g)
        basis = self._free(state)
        chain = BorderedChain(
            D, beside, E.reshape(count, n, 6 * m) @ basis,
            basis.T @ C.reshape(6 * m, 6 * m) @ basis, g, basis.T @ b.ravel(),
        )  # fmt: skip
        return chain, basis

    def _link(self, state: MapState, native: Any, D: Array, g: Array) -> Array:
        """Add what the IMU says, in place; the blocks beside the diagonal."""
        assert self.inertial is not None  # noqa: S101 - asked for with one only
        error, before, after = self.inertial.rows(native, *state.motion)
        left, right = before.transpose(0, 2, 1), after.transpose(0, 2, 1)
        D[:-1] += left @ before
        D[1:] += right @ after
        g[:-1] += (left @ error[..., None])[..., 0]
        g[1:] += (right @ error[..., None])[..., 0]
        velocity, bias = np.arange(6, 9), np.arange(9, 15)
        D[:, velocity, velocity] += LEAST
        D[0, bias, bias] += self._bias_scale() ** -2
        g[0, 9:] += state.motion[2][0] * self._bias_scale() ** -2
        return left @ after

    def _free(self, state: MapState) -> Array:
        """Columns (6 M, q): all steps but those that only move the world."""
        own = 6 * self.reference
        every = np.eye(6 * len(state.markers))
        others = np.delete(every, np.s_[own : own + 6], axis=1)
        if self.inertial is None:
            return others
        up = rotation_matrix(state.markers[self.reference, :4])[2]  # the vertical in the marker's axes
        tilts = np.linalg.svd(up[None])[2][1:]
        return np.hstack([every[:, own : own + 3] @ tilts.T, others])


def _summed(values: Array, index: NDArray[np.int64], count: int) -> Array:
    """Sums of rows of equal index."""
    total = np.zeros((count, *values.shape[1:]))
    np.add.at(total, index, values)
    return total
