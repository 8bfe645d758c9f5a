"""Many samples of wheel odometry made into one motion a step, with the covariance that they gather."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError
from sequential.log import Stream
from sequential.manifold import wrap_angle

__all__ = ["WheelNoise", "nodes_at", "wheel_steps"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class WheelNoise:
    """What the wheels do not say, as the square roots of spectral densities.

    Parameters
    ----------
    along, across : m/√s
    heading : rad/√s
    slip : m/√m, along the track, for the distance driven
    turn_slip : rad/√rad, for the angle turned
    """

    along: float
    across: float
    heading: float
    slip: float = 0.0
    turn_slip: float = 0.0


def nodes_at(stamps: Ints, start: int, longest_s: float) -> Ints:
    """Times of steps (K,) ns: `start`, every later stamp, and others so that none lasts over `longest_s`."""
    wanted = np.unique(np.concatenate([[start], stamps[stamps > start]]))
    gaps = np.diff(wanted)
    pieces = np.maximum(1, np.ceil(gaps / (longest_s * 1e9))).astype(np.int64)
    first = np.repeat(np.arange(len(gaps)), pieces)
    nth = np.arange(len(first)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1
    return np.append(wanted[:1], wanted[first] + gaps[first] * nth // pieces[first])


def wheel_steps(wheels: Stream, nodes: Ints, noise: WheelNoise) -> tuple[Array, Array]:
    """Motion of a planar robot from node to node.

    Parameters
    ----------
    wheels : speed (m/s) and turn rate (rad/s), each held until the next; before the first the robot stands
    nodes : (K,) ns, ascending

    Returns
    -------
    moves : (K-1, 3) pose of each node in the frame of the one before: m, m, rad
    covs : (K-1, 3, 3) in the tangent at each move (GTSAM's right chart)

    Raises
    ------
    ShapeError, DataError
    """
    if wheels.values.shape[1] != 2:
        msg = f"wheel odometry has two columns, speed and turn rate; got {wheels.values.shape[1]}"
        raise ShapeError(msg)
    if len(nodes) < 2 or (np.diff(nodes) <= 0).any():
        msg = f"odometry is gathered between two ascending times at least, got {len(nodes)}"
        raise DataError(msg)
    inside = wheels.t[(wheels.t > nodes[0]) & (wheels.t < nodes[-1])]
    edges = np.unique(np.concatenate([inside, nodes]))
    dt = np.diff(edges) * 1e-9
    row = np.searchsorted(wheels.t, edges[:-1], side="right") - 1
    speed, rate = np.where(row >= 0, wheels.values[np.maximum(row, 0)].T, 0.0)
    heading = np.append(0.0, np.cumsum(rate * dt))
    chord = speed * dt * np.sinc(rate * dt / (2.0 * np.pi))
    along = heading[:-1] + 0.5 * rate * dt
    steps = chord[:, None] * np.stack([np.cos(along), np.sin(along)], axis=1)
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    at = np.searchsorted(edges, nodes)
    shift = _turned(place[at[1:]] - place[at[:-1]], -heading[at[:-1]])
    moves = np.column_stack([shift, wrap_angle(heading[at[1:]] - heading[at[:-1]])])
    end = at[np.searchsorted(at, np.arange(len(dt)), side="right")]  # the node that a sample leads to
    lever = _turned(place[end] - place[1:], -heading[end])
    each = _gathered(heading[1:] - heading[end], lever, _variances(speed, rate, dt, noise))
    return moves, np.add.reduceat(each, at[:-1])


def _variances(speed: Array, rate: Array, dt: Array, noise: WheelNoise) -> Array:
    """(S, 3) of each sample, in the robot's frame."""
    distance, angle = np.abs(speed) * dt, np.abs(rate) * dt
    along = noise.along**2 * dt + noise.slip**2 * distance
    turn = noise.heading**2 * dt + noise.turn_slip**2 * angle
    return np.stack([along, noise.across**2 * dt, turn], axis=1)


def _gathered(turn: Array, lever: Array, variance: Array) -> Array:
    """(S, 3, 3) covariance of each sample's error, carried to the end of its step."""
    carry = np.zeros((len(turn), 3, 3))
    c, s = np.cos(turn), np.sin(turn)
    carry[:, 0, 0], carry[:, 0, 1], carry[:, 1, 0], carry[:, 1, 1] = c, -s, s, c
    carry[:, 0, 2], carry[:, 1, 2], carry[:, 2, 2] = -lever[:, 1], lever[:, 0], 1.0
    return np.asarray((carry * variance[:, None, :]) @ np.swapaxes(carry, 1, 2))


def _turned(points: Array, angle: Array) -> Array:
    """Points (N, 2), each turned by its own angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]], axis=1)
