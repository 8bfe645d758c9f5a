"""A recording made ready for estimators: what may be used, what it is scored against, how it is modelled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError, ShapeError
from sequential.history import Run
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.manifold import SE2, SE3, Manifold, NavState, Product, Vector
from sequential.manifold.quaternion import rotation_matrix
from sequential.model import StateSpace
from sequential.tuning import Knob

__all__ = ["Dataset", "Truth", "require_file"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """Where the vehicle really was, by an instrument far better than the sensors under test.

    Parameters
    ----------
    t : (N,) int64 nanoseconds, increasing
    position : (N, 2) or (N, 3) world frame, m
    heading : (N,) rad, or None
    quaternion : (N, 4) w x y z, world_q_body, or None
    max_gap : a moment farther than this many seconds from every sample has no truth
    """

    t: Ints
    position: Array
    heading: Array | None = None
    quaternion: Array | None = None
    max_gap: float = float("inf")

    def __post_init__(self) -> None:
        for name in ("position", "heading", "quaternion"):
            values = getattr(self, name)
            if values is not None and len(values) != len(self.t):
                msg = f"the truth has {len(self.t)} stamps and {len(values)} rows of {name}; they must agree"
                raise ShapeError(msg)

    def __len__(self) -> int:
        return len(self.t)

    def at(self, t: NDArray[np.generic]) -> tuple[Ints, Truth]:
        """The truth at other times, interpolated.

        Parameters
        ----------
        t : (K,) float seconds or int nanoseconds, such as `run.t`

        Returns
        -------
        rows : (M,) which of the given times have a truth: within the recording and near a sample
        truth : the truth at those M times

        Raises
        ------
        DataError
            where there are fewer than two samples to go between.
        """
        if len(self.t) < 2:
            msg = f"a truth needs two samples at least to be interpolated, it has {len(self.t)}"
            raise DataError(msg)
        wanted = nanoseconds(t)
        after = np.clip(np.searchsorted(self.t, wanted), 1, len(self.t) - 1)
        nearest = np.minimum(np.abs(wanted - self.t[after - 1]), np.abs(self.t[after] - wanted)) * 1e-9
        inside = (wanted >= self.t[0]) & (wanted <= self.t[-1])
        rows = np.flatnonzero(inside & (nearest <= self.max_gap))
        origin, stamps = self.t[0], wanted[rows]
        x, xp = (stamps - origin) * 1e-9, (self.t - origin) * 1e-9

        def columns(values: Array) -> Array:
            return np.stack([np.interp(x, xp, column) for column in values.T], axis=1)

        heading = None if self.heading is None else np.interp(x, xp, np.unwrap(self.heading))
        quaternion = None
        if self.quaternion is not None:
            joined = columns(_continuous(self.quaternion))
            quaternion = joined / np.linalg.norm(joined, axis=1, keepdims=True)
        return rows, Truth(stamps, columns(self.position), heading, quaternion, self.max_gap)


def _continuous(q: Array) -> Array:
    """Quaternions (N, 4) with signs chosen so that neighbours lie on the same side of the sphere."""
    flips = np.where(np.einsum("ni,ni->n", q[1:], q[:-1]) < 0, -1.0, 1.0)
    signs = np.concatenate([[1.0], np.cumprod(flips)])
    return np.asarray(q * signs[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """One recording with its model.

    Parameters
    ----------
    log : only what an estimator may use
    model : with the noise as the recording's makers state it, or as this project set it (see `notes`)
    held_out : readings kept back, for scoring only; None where nothing is held out
    truth : for scoring only; None where the recording has none
    axes : 2 or 3, of positions
    knobs : the noise that `tune` may change; `build` makes a model from their values by name
    notes : one sentence each about what a reader of a result should know
    default_estimators : names for a comparison that names none
    lags : windows, in seconds, of a fixed-lag smoother for a comparison that names none
    """

    name: str
    title: str
    log: SensorLog
    model: StateSpace
    held_out: Stream | None
    truth: Truth | None
    axes: int
    knobs: tuple[Knob, ...]
    build: Callable[[Mapping[str, float]], StateSpace]
    notes: tuple[str, ...] = ()
    default_estimators: tuple[str, ...] = ("ekf", "ekf_rts", "ieks", "batch")
    lags: tuple[float, ...] = ()

    def positions(self, run: Run) -> Array:
        """(N, axes) positions of the vehicle in the world frame, m."""
        storage, _, _ = _moving_part(run.manifold, self.axes)
        return run.mean[:, storage : storage + self.axes]

    def position_cov(self, run: Run) -> Array:
        """(N, axes, axes) covariances of `positions`, along the axes of the world, m²."""
        _, tangent, rotation = _moving_part(run.manifold, self.axes)
        block = run.cov[:, tangent : tangent + self.axes, tangent : tangent + self.axes]
        if rotation is None:
            return block
        world_R_body = rotation(run.mean)
        return world_R_body @ block @ np.swapaxes(world_R_body, -1, -2)


Rotations = Callable[[Array], Array]


def _moving_part(manifold: Manifold, axes: int) -> tuple[int, int, Rotations | None]:
    """Where a position lies in storage and tangent, and what turns its tangent into the world."""
    if isinstance(manifold, Product):
        parts = [(manifold.storage(k).start, manifold.tangent(k).start, m) for k, m in manifold.parts.items()]
    else:
        parts = [(0, 0, manifold)]
    for storage, tangent, member in parts:
        if isinstance(member, NavState | SE3) and axes == 3:
            return storage + 4, tangent + 3, lambda x, at=storage: rotation_matrix(x[:, at : at + 4])
        if isinstance(member, SE2) and axes == 2:
            return storage, tangent, lambda x, at=storage: _planar(x[:, at + 2])
    for storage, tangent, member in parts:
        if isinstance(member, Vector) and member.size >= axes:
            return storage, tangent, None
    msg = f"the state {manifold} has no part that holds a position of {axes} axes"
    raise ModelError(msg)


def _planar(heading: Array) -> Array:
    """(N, 2, 2) world_R_body."""
    c, s = np.cos(heading), np.sin(heading)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def require_file(path: Path, what: str, remedy: str) -> Path:
    """The path itself, or a `DataError` that says what is missing and what to do."""
    if not path.is_file():
        msg = f"{what} is not at {path}: {remedy}"
        raise DataError(msg)
    return path
