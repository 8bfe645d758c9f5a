"""A recording as a chain of nodes, and its solution by filtering and smoothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.attitude.smoother_model import AttitudeModel
from sequential.errors import DataError, MissingStreamError
from sequential.sensors.recording import ImuRecording

__all__ = ["AttitudeChain", "ChainSolution", "attitude_chain"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
SIZE, MOVING = 23, 10
GAP = 3.0  # median intervals without a sample
LONGEST_FIELD = 1.0  # s that one reading of a slow magnetometer stands for
START = 0.5  # s at the beginning whose mean gives the first orientation
STILL_RATE, STILL_RIPPLE, STILL_ACCEL = np.radians(2.5), np.radians(1.0), 0.25
STILL_GYRO_NOISE, STILL_ACCEL_NOISE = np.radians(2.5), 0.5  # standard deviations within a node
STILL_REACH = 0.5  # s on either side
STUCK_RATE = 0.5  # rad/s of turning in which a field must change


class ChainSolution(NamedTuple):
    """K + 1 nodes."""

    rotation: Array  # (K + 1, 3, 3) body to world
    state: Array  # (K + 1, 23), the first three zero
    cov: Array  # (K + 1, 6, 6) of rotation (in the world) and gyro bias
    filtered: Array  # (K + 1, 23, 23) covariance on the way there
    start_cov: Array  # (23, 23) of the first node
    trust: Array  # (K,) of the field in this solution, 0 to 1


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeChain:
    """Preintegrated nodes with everything that a solver needs.

    Parameters
    ----------
    model : noises
    dt : (N,) time that each sample is integrated over, s
    gyro : (N, 3)
    first : (K + 1,) first sample of each node, and N
    nodes : (K, 66), columns of `smoother_nodes_kernel`
    rest : (K,)
    bias : (3,) guess of the gyro's bias, to begin with
    start : (3, 3) rotation, to begin with
    field : whether there is a magnetometer
    """

    model: AttitudeModel
    dt: Array
    gyro: Array
    first: NDArray[np.int64]
    nodes: Array
    rest: Flags
    bias: Array
    start: Array
    field: bool

    def solve(
        self,
        around: ChainSolution | None = None,
        *,
        weight: Array | None = None,
        field: bool = True,
        covariance: bool = True,
    ) -> ChainSolution:
        """Filter forwards, smooth backwards, about a solution or else about the filter's own estimate.

        Parameters
        ----------
        weight : (K,) of the readings of the field
        field : use the magnetometer
        covariance : also of the smoothed states
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
        settings, start_cov = self.model.settings(), self.model.prior(heading=field)
        forward(
            self.nodes, self.rest, given, settings, start, prior, start_cov, field,
            around is not None, rotation, state, deviation, cov, gains, by_gyro, by_push, rows, trust,
        )  # fmt: skip
        smoothed, end = np.zeros((count + 1, 6, 6)), np.zeros((SIZE, SIZE))
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
        off = world.copy()
        off[:, 0] -= solution.state[:-1, 9]
        if seen.any():
            off[:, 1] -= np.median(np.hypot(world[seen, 0], world[seen, 1]))
            off[:, 2] -= np.median(world[seen, 2])
        square = np.sum(off**2, axis=1) / self.model.mag_scatter**2
        return np.where(seen, 1.0 / (1.0 + square) ** 2, 0.0)

    def first_weights(self) -> Array:
        """(K,) trust before there is a solution: by the strength of the field alone."""
        from sequential.attitude.smoother_nodes_kernel import FIELD, FIELD_TIME

        norm = np.linalg.norm(self.nodes[:, FIELD : FIELD + 3], axis=1)
        square = ((norm - 1.0) / self.model.mag_scatter) ** 2
        return np.where(self.nodes[:, FIELD_TIME] > 0, 1.0 / (1.0 + square) ** 2, 0.0)


def attitude_chain(recording: ImuRecording, model: AttitudeModel, *, field: bool = True) -> AttitudeChain:
    """Cut a recording into nodes.

    Raises
    ------
    MissingStreamError, DataError
    """
    from sequential.attitude.smoother_nodes_kernel import RATE, WIDTH, summarise

    recording.require("gyro", "accel")
    gyro, accel = recording.gyro, recording.accel
    if gyro is None or accel is None:  # for the type checker: `require` has raised
        raise MissingStreamError("an attitude smoother needs gyro and accelerometer")
    if len(recording) < 2:
        raise DataError(f"recording {recording.name!r} holds one sample; there is no motion to smooth")
    dt, lost = _intervals(recording)
    mag = _field(recording) if field else None
    stride = max(1, round(model.interval / float(np.median(dt))))
    first = np.append(np.arange(0, len(dt), stride), len(dt)).astype(np.int64)
    nodes = np.empty((len(first) - 1, WIDTH))
    read = np.full(gyro.shape, np.nan) if mag is None else mag
    summarise(dt, lost, gyro, accel, read, first, np.zeros(3), LONGEST_FIELD, nodes)
    rest = _still(nodes)
    bias = nodes[rest, RATE : RATE + 3].mean(axis=0) if rest.any() else np.zeros(3)
    start = _start(nodes[: max(1, round(START / model.interval))])
    return AttitudeChain(model, dt, gyro, first, nodes, rest, bias, start, mag is not None)


def _intervals(recording: ImuRecording) -> tuple[Array, Array]:
    """(N,) time that each sample is integrated over, and (N,) what a gap before it leaves unknown, s."""
    dt = recording.dt
    usual = float(np.median(dt))
    dt = np.concatenate([[usual], dt])
    gap = dt > GAP * usual
    return np.where(gap, usual, dt), np.where(gap, dt - usual, 0.0)


def _field(recording: ImuRecording) -> Array | None:
    """(N, 3) in units of the usual norm, NaN where there is no reading; None without a magnetometer.

    Raises
    ------
    DataError
        where the body turns and the field does not.
    """
    mag, turning = recording.mag, recording.gyro
    if mag is None or turning is None:
        return None
    norm = np.linalg.norm(mag, axis=1)
    known = np.isfinite(norm) & (norm > 0)
    if not known.any():
        return None
    if known.sum() > 2 and np.all(np.ptp(mag[known], axis=0) == 0) and np.ptp(turning) > STUCK_RATE:
        msg = (
            f"mag of recording {recording.name!r} never changes although the gyro turns: the magnetometer is "
            "stuck; give the recording without it for a heading that starts at an arbitrary direction"
        )
        raise DataError(msg)
    return np.where(known[:, None], mag / np.median(norm[known]), np.nan)


def _still(nodes: Array) -> Flags:
    """(K,) nodes amid others in which neither gyro nor accelerometer departs from its mean."""
    from sequential.attitude.smoother_nodes_kernel import ACCEL, ACCEL_VAR, GYRO_VAR, RATE, TIME

    reach = max(1, round(STILL_REACH / float(np.median(nodes[:, TIME]))))
    if len(nodes) < 2 * reach + 1:
        return np.zeros(len(nodes), dtype=np.bool_)
    rate, pull = _departure(nodes[:, RATE : RATE + 3], reach), _departure(nodes[:, ACCEL : ACCEL + 3], reach)
    mean = np.linalg.norm(_sliding(nodes[:, RATE : RATE + 3], reach), axis=1)
    calm = (mean < STILL_RATE) & (rate < STILL_RIPPLE) & (pull < STILL_ACCEL)
    calm &= (nodes[:, GYRO_VAR] < STILL_GYRO_NOISE**2) & (nodes[:, ACCEL_VAR] < STILL_ACCEL_NOISE**2)
    padded = np.pad(calm, reach, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    return np.ascontiguousarray(windows.all(axis=1))


def _sliding(values: Array, reach: int) -> Array:
    """(K, 3) mean over `reach` rows on either side, the outermost repeated."""
    padded = np.pad(values, ((reach + 1, reach), (0, 0)), mode="edge")
    padded[0] = 0.0
    total = np.cumsum(padded, axis=0)
    return (total[2 * reach + 1 :] - total[: -2 * reach - 1]) / (2 * reach + 1)


def _departure(values: Array, reach: int) -> Array:
    """(K,) distance of each row from the mean around it."""
    return np.asarray(np.linalg.norm(values - _sliding(values, reach), axis=1))


def _start(nodes: Array) -> Array:
    """(3, 3) rotation of the first node: up by the mean specific force, north by the mean field or any."""
    from sequential.attitude.smoother_nodes_kernel import ACCEL, FIELD, FIELD_TIME

    up = nodes[:, ACCEL : ACCEL + 3].mean(axis=0)
    size = float(np.linalg.norm(up))
    up = up / size if size > 0 else np.array([0.0, 0.0, 1.0])
    seen = nodes[nodes[:, FIELD_TIME] > 0, FIELD : FIELD + 3]
    east = np.cross(seen.mean(axis=0), up) if len(seen) else np.zeros(3)
    if np.linalg.norm(east) < 1e-3:
        east = np.cross(np.eye(3)[np.argmin(np.abs(up))], up)
    east /= np.linalg.norm(east)
    return np.stack([east, np.cross(up, east), up])
