"""How kinds of variables look in GTSAM: keys, values in and out, many at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold import (
    SE2,
    SE3,
    SO2,
    SO3,
    Manifold,
    NavState,
    Vector,
    quaternion_from_matrix,
)
from sequential.slam import SlamProblem, Values

__all__ = ["VariableType", "insert_values", "keys_of", "read_all", "read_values", "require_type", "type_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
SHIFT = 56  # a gtsam.Symbol is a letter above so many bits of index
LOW = np.uint64((1 << SHIFT) - 1)
FEW = 20  # variables below which bulk access does not pay


@dataclass(frozen=True, slots=True)
class VariableType:
    """One manifold as GTSAM holds it."""

    name: str  # as in Values.at…, calculateEstimate…, PriorFactor…, BetweenFactor…
    to_gtsam: Callable[[Array], list[Any]]  # rows (N, n)
    to_row: Callable[[Any], Any]  # one object -> (n,)


def _pose3(rows: Array) -> list[Any]:
    turn, pose = gtsam.Rot3.Quaternion, gtsam.Pose3
    return [
        pose(turn(w, x, y, z), place)
        for (w, x, y, z), place in zip(rows[:, :4].tolist(), rows[:, 4:], strict=True)
    ]


def _quaternion(turn: Any) -> list[float]:
    q = turn.toQuaternion()
    row = [q.w(), q.x(), q.y(), q.z()]
    return [-value for value in row] if row[0] < 0 else row


def _nav_state(rows: Array) -> list[Any]:
    return [
        gtsam.NavState(gtsam.Rot3.Quaternion(*row[:4]), np.array(row[4:7]), np.array(row[7:]))
        for row in rows.tolist()
    ]


TYPES: dict[type[Manifold], VariableType] = {
    SE2: VariableType(
        "Pose2",
        lambda rows: [gtsam.Pose2(x, y, turn) for x, y, turn in rows.tolist()],
        lambda pose: (pose.x(), pose.y(), pose.theta()),
    ),
    SE3: VariableType(
        "Pose3", _pose3, lambda pose: [*_quaternion(pose.rotation()), *pose.translation().tolist()]
    ),
    SO2: VariableType(
        "Rot2",
        lambda rows: [gtsam.Rot2(angle) for angle in rows[:, 0].tolist()],
        lambda turn: (turn.theta(),),
    ),
    SO3: VariableType(
        "Rot3", lambda rows: [gtsam.Rot3.Quaternion(*row) for row in rows.tolist()], _quaternion
    ),
    Vector: VariableType("Vector", list, lambda vector: vector),
    NavState: VariableType(
        "NavState",
        _nav_state,
        lambda state: [*_quaternion(state.attitude()), *state.position(), *state.velocity()],
    ),
}


def type_of(manifold: Manifold) -> VariableType | None:
    """GTSAM's type for a manifold; None where it has none."""
    return TYPES.get(type(manifold))


def require_type(manifold: Manifold, kind: str) -> VariableType:
    """The same; raises `ModelError` where there is none."""
    found = type_of(manifold)
    if found is None:
        msg = f"variables of kind {kind!r} live on {manifold!r}, which GTSAM has no type for"
        raise ModelError(msg)
    return found


def keys_of(kind: str, index: Iterable[int] | Ints) -> list[int]:
    """Keys of variables of a kind: `gtsam.symbol(kind, i)` of each."""
    base = ord(kind) << SHIFT
    return [base + i for i in np.asarray(index, dtype=np.int64).tolist()]


def insert_values(problem: SlamProblem, values: Values) -> Any:
    """All of them as `gtsam.Values`."""
    found = gtsam.Values()
    for kind, index in values.index.items():
        objects = require_type(problem.kinds[kind], kind).to_gtsam(values.rows[kind])
        for key, value in zip(keys_of(kind, index), objects, strict=True):
            found.insert(key, value)
    return found


def read_all(problem: SlamProblem, source: Any) -> Values:
    """Every variable of `gtsam.Values` that is of a kind of the problem, as ours; in bulk where GTSAM can."""
    keys = np.array(source.keys(), dtype=np.uint64)
    letters, index = (keys >> np.uint64(SHIFT)).astype(np.int64), (keys & LOW).astype(np.int64)
    found: dict[str, Ints] = {}
    rows: dict[str, Array] = {}
    for kind, manifold in problem.kinds.items():
        here = letters == ord(kind)
        if here.any():
            found[kind] = index[here]
            rows[kind] = _rows_of(kind, manifold, source, keys, letters)
    return Values(found, rows)


def _rows_of(kind: str, manifold: Manifold, source: Any, keys: Any, letters: Ints) -> Array:
    """(n, size) all variables of one kind, by ascending key."""
    if isinstance(manifold, Vector):
        return np.array(gtsam.utilities.extractVectors(source, kind)).reshape(-1, manifold.size)
    name = require_type(manifold, kind).name
    here = keys[letters == ord(kind)].tolist()
    if name in BULK and len(here) > FEW:
        whole, place = BULK[name](source), 0
        # all poses come together, in the order of their keys
        for letter in np.unique(letters).tolist():
            count, first = int((letters == letter).sum()), keys[letters == letter][0]
            if letter == ord(kind):
                return np.ascontiguousarray(whole[place : place + count])
            place += count if _is_a(source, name, int(first)) else 0
    at, to_row = getattr(source, f"at{name}"), require_type(manifold, kind).to_row
    return np.array([to_row(at(key)) for key in here], dtype=np.float64).reshape(-1, manifold.size)


def _is_a(source: Any, name: str, key: int) -> bool:
    """Whether a variable is of a type."""
    try:
        getattr(source, f"at{name}")(key)
    except RuntimeError:
        return False
    return True


def _flat_poses(source: Any) -> Array:
    """(n, 7) all poses of space."""
    flat = gtsam.utilities.extractPose3(source)
    turn = quaternion_from_matrix(flat[:, :9].reshape(-1, 3, 3))
    return np.concatenate([turn, flat[:, 9:]], axis=1)


BULK = {"Pose2": lambda source: np.array(gtsam.utilities.extractPose2(source)), "Pose3": _flat_poses}


def read_values(problem: SlamProblem, source: Any, index: dict[str, Ints]) -> Values:
    """Variables of `gtsam.Values` as ours; raises `DataError` where one is missing."""
    found = read_all(problem, source)
    return Values(dict(index), {kind: found.at(kind, known) for kind, known in index.items()})
