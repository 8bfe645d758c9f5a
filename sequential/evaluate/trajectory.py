"""Stamped poses, and how two recordings of the same motion are brought to the same times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError, TimeOrderError
from sequential.log import frozen, nanoseconds
from sequential.manifold import (
    quaternion_exp,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
)

__all__ = ["Trajectory", "associate", "interpolate"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Poses of a body in the world.

    Parameters
    ----------
    t : (N,) int64 nanoseconds, or floats in seconds; not backwards
    position : (N, 3) m; (N, 2) is completed with z = 0
    quaternion : (N, 4) world_q_body, scalar first, any norm but zero; None where only positions are known
    """

    t: Ints
    position: Array
    quaternion: Array | None = None

    def __post_init__(self) -> None:
        t = np.atleast_1d(nanoseconds(self.t)).copy()
        t.flags.writeable = False
        position = np.asarray(self.position, dtype=np.float64)
        if position.ndim == 2 and position.shape[1] == 2:
            position = np.column_stack([position, np.zeros(len(position))])
        _require(position, (len(t), 3), "positions")
        if len(back := np.flatnonzero(np.diff(t) < 0)):
            k = int(back[0]) + 1
            raise TimeOrderError(
                f"the trajectory goes backwards at pose {k}: {t[k - 1] * 1e-9:.6f} s then "
                f"{t[k] * 1e-9:.6f} s; sort the poses by their stamps"
            )
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "position", frozen(position))
        if self.quaternion is not None:
            quaternion = np.asarray(self.quaternion, dtype=np.float64)
            _require(quaternion, (len(t), 4), "quaternions")
            if len(zero := np.flatnonzero(~np.any(quaternion, axis=1))):
                raise DataError(f"the quaternion of pose {zero[0]} is zero; a rotation is a unit quaternion")
            object.__setattr__(self, "quaternion", frozen(quaternion_normalize(quaternion)))

    def __len__(self) -> int:
        return len(self.t)

    @classmethod
    def planar(cls, t: ArrayLike, position: ArrayLike, heading: ArrayLike) -> Trajectory:
        """Poses in the plane z = 0: position (N, 2) m, heading (N,) rad about z."""
        half = 0.5 * np.asarray(heading, dtype=np.float64)
        zero = np.zeros_like(half)
        quaternion = np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)
        return cls(np.asarray(t), np.asarray(position), quaternion)

    def select(self, rows: NDArray[np.generic]) -> Trajectory:
        """The poses that a mask or an index array names."""
        quaternion = None if self.quaternion is None else self.quaternion[rows]
        return Trajectory(self.t[rows], self.position[rows], quaternion)


def _require(values: Array, shape: tuple[int, int], what: str) -> None:
    if values.shape != shape:
        raise ShapeError(f"{shape[0]} stamps need {what} of shape {shape}, got {values.shape}")
    if len(bad := np.flatnonzero(~np.isfinite(values).all(axis=1))):
        raise NotFiniteError(
            f"the {what} of pose {bad[0]} hold NaN or infinity (and {len(bad) - 1} more); drop them"
        )


def associate(t_ref: ArrayLike, t_est: ArrayLike, max_diff_ns: int = 10_000_000) -> tuple[Ints, Ints]:
    """Pair the stamps of two recordings, nearest with nearest: rows of the reference, rows of the estimate.

    Every stamp of the shorter recording takes the nearest one of the longer (the earlier on a tie) unless
    it is further than `max_diff_ns` away, as evo does.

    Parameters
    ----------
    t_ref, t_est : (N,), (M,) int64 nanoseconds or float seconds, sorted

    Raises
    ------
    DataError
        if no two stamps are that close.
    """
    ref, est = np.atleast_1d(nanoseconds(t_ref)), np.atleast_1d(nanoseconds(t_est))
    if not (len(ref) and len(est)):
        raise DataError(
            f"nothing to associate: {len(ref)} stamps of the reference, {len(est)} of the estimate"
        )
    swapped = len(est) <= len(ref)
    few, many = (est, ref) if swapped else (ref, est)
    after = np.clip(np.searchsorted(many, few, side="right"), 0, len(many) - 1)
    before = np.clip(after - 1, 0, len(many) - 1)
    nearest = np.where(np.abs(many[before] - few) <= np.abs(many[after] - few), before, after)
    kept = np.flatnonzero(np.abs(many[nearest] - few) <= max_diff_ns)
    if not len(kept):
        raise DataError(
            f"no stamp of the estimate is within {max_diff_ns * 1e-6:g} ms of one of the reference: "
            f"the reference spans {_span(ref)}, the estimate {_span(est)}; check their clocks, "
            "or allow a larger difference"
        )
    rows = kept.astype(np.int64), nearest[kept].astype(np.int64)
    return (rows[1], rows[0]) if swapped else rows


def _span(t: Ints) -> str:
    return f"{t[0] * 1e-9:.3f} to {t[-1] * 1e-9:.3f} s"


def interpolate(
    trajectory: Trajectory, t: ArrayLike, max_gap_ns: int | None = None
) -> tuple[Trajectory, NDArray[np.bool_]]:
    """Poses of a trajectory (usually the truth) at other times.

    Positions are interpolated linearly, rotations along the shortest turn.

    Returns
    -------
    poses, covered
        The poses at the covered times, and a mask (N,) of the times asked for: False before the first
        and after the last pose, and inside pauses longer than `max_gap_ns`.

    Raises
    ------
    DataError
        if no time is covered.
    """
    wanted = np.atleast_1d(nanoseconds(t))
    known = trajectory.t
    after = np.searchsorted(known, wanted, side="left")
    inside = (after < len(known)) & (wanted >= known[0])
    after = np.clip(after, 0, len(known) - 1)
    exact = known[after] == wanted
    before = np.where(exact, after, np.maximum(after - 1, 0))
    step = known[after] - known[before]
    covered = inside if max_gap_ns is None else inside & (step <= max_gap_ns)
    if not covered.any():
        raise DataError(
            f"the trajectory spans {_span(known)} and covers none of the {len(wanted)} times asked for"
        )
    a, b, step = before[covered], after[covered], step[covered]
    share = (wanted[covered] - known[a]) / np.where(step > 0, step, 1)
    position = trajectory.position[a] + share[:, None] * (trajectory.position[b] - trajectory.position[a])
    quaternion = None
    if trajectory.quaternion is not None:
        start, end = trajectory.quaternion[a], trajectory.quaternion[b]
        turn = quaternion_log(quaternion_multiply(quaternion_inverse(start), end))
        quaternion = quaternion_multiply(start, quaternion_exp(share[:, None] * turn))
    return Trajectory(wanted[covered], position, quaternion), covered
