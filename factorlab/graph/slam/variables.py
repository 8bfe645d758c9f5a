"""How kinds of variables look in GTSAM: keys, values in and out, many at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, SO2, SO3, Manifold, NavState, Vector
from sequential.slam import SlamProblem, Values

__all__ = ["VariableType", "insert_values", "keys_of", "read_values", "require_type", "type_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
SHIFT = 56  # a gtsam.Symbol is a letter above so many bits of index


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


def read_values(problem: SlamProblem, source: Any, index: dict[str, Ints]) -> Values:
    """Variables of `gtsam.Values` as ours."""
    rows = {}
    for kind, known in index.items():
        manifold = problem.kinds[kind]
        found = require_type(manifold, kind)
        at = getattr(source, f"at{found.name}")
        row = np.array([found.to_row(at(key)) for key in keys_of(kind, known)], dtype=np.float64)
        rows[kind] = row.reshape(-1, manifold.size)
    return Values(dict(index), rows)
