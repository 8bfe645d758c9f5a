"""What nothing in a SLAM problem can see: where the whole of it stands in the world, and how it is turned.

Measurements between poses and landmarks stay the same when all are carried along by one rigid motion.  Which
kinds of variables are carried (poses, points) and which are not (a scale, a camera's place on the robot) is
found out by trying.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, Manifold, Vector
from sequential.manifold.quaternion import rotation_matrix
from sequential.manifold.so3 import skew
from sequential.slam.problem import Factors, SlamProblem

__all__ = ["FRAME", "POINT", "VECTOR", "act", "directions", "world_roles"]

Array = NDArray[np.float64]

FRAME, POINT, VECTOR, STILL = "frame", "point", "vector", "still"
TRIES, ALIKE = 4, 1e-9


def world_roles(problem: SlamProblem) -> dict[str, str]:
    """How each kind answers to a rigid motion of the world: "frame", "point", "vector" or "still".

    Groups of one variable (priors, absolute sensors) have no say.

    Raises
    ------
    ModelError
        where the newest variables have no pose, or the measurements between variables change with the world.
    """
    rigid = next((m for kind, m in problem.kinds.items() if _moves(problem, kind, m)), None)
    if rigid is None:
        msg = "the problem has no moving kind on SE2 or SE3, so nothing says what a motion of its world is"
        raise ModelError(msg)
    groups = [group for group in problem.factors if len(group.slots) > 1 and len(group)]
    options = {kind: _options(problem, kind, manifold, rigid) for kind, manifold in problem.kinds.items()}
    for chosen in product(*options.values()):
        roles = dict(zip(options, chosen, strict=True))
        if all(_unchanged(group, roles, rigid) for group in groups):
            return roles
    msg = (
        "measurements between the variables change when the world is moved as a whole, so it has no frame "
        "to be free in: linearisation='standard' takes such a problem"
    )
    raise ModelError(msg)


def act(rigid: Manifold, motion: Array, role: str, value: Array) -> Array:
    """Carry values (..., size) of one role along by a rigid motion, an element (n,) of SE2 or SE3."""
    if role == FRAME:
        return _composed(rigid, motion, value)
    if role in (POINT, VECTOR):
        turn, shift = _turn(rigid, motion)
        return np.asarray(value @ turn.T + (shift if role == POINT else 0.0))
    return value


def directions(rigid: Manifold, role: str, value: Array, dim: int) -> Array:
    """(..., dim, g) how tangents answer to a small motion of the world, in the tangent of `rigid`.

    `value` (..., size) are variables of one role, whose manifold has `dim` directions.
    """
    if role == FRAME:
        return rigid.transport(rigid.identity(), value)[0]
    moved = np.zeros((*value.shape[:-1], dim, rigid.dim))
    if role not in (POINT, VECTOR):
        return moved
    if isinstance(rigid, SE2):
        moved[..., 0, 2], moved[..., 1, 2] = -value[..., 1], value[..., 0]
        moved[..., :2] = np.eye(2) if role == POINT else 0.0
        return moved
    moved[..., :3] = -skew(value)
    moved[..., 3:] = np.eye(3) if role == POINT else 0.0
    return moved


def rigid_of(problem: SlamProblem, roles: Mapping[str, str]) -> tuple[str, Manifold]:
    """The kind that is the robot's pose, and its manifold."""
    kind = next(k for k in problem.kinds if k in problem.moving and roles[k] == FRAME)
    return kind, problem.kinds[kind]


def _moves(problem: SlamProblem, kind: str, manifold: Manifold) -> bool:
    return kind in problem.moving and isinstance(manifold, SE2 | SE3)


def _options(problem: SlamProblem, kind: str, manifold: Manifold, rigid: Manifold) -> tuple[str, ...]:
    """Roles that a kind may have, likeliest first; the robot's pose is a frame."""
    if repr(manifold) == repr(rigid):
        return (FRAME,) if kind in problem.moving else (FRAME, STILL)
    if isinstance(manifold, Vector) and manifold.dim == (2 if isinstance(rigid, SE2) else 3):
        return (POINT, VECTOR, STILL)
    return (STILL,)


def _unchanged(group: Factors, roles: Mapping[str, str], rigid: Manifold) -> bool:
    """Whether random variables are measured alike before and after a motion of the world."""
    rng = np.random.default_rng(0)
    motion = rigid.random(rng)
    values = [manifold.random(rng, 0.5, (TRIES,)) for manifold in group.model.manifolds]
    moved = [act(rigid, motion, roles[slot], v) for slot, v in zip(group.slots, values, strict=True)]
    with np.errstate(all="ignore"):
        before, after = group.model.expected(*values), group.model.expected(*moved)
        gap = np.abs(group.model.measured.local(before, after))
    seen = np.isfinite(gap)
    return bool(not seen.any() or gap[seen].max() < ALIKE * (1.0 + np.abs(before[np.isfinite(before)]).max()))


def _turn(rigid: Manifold, motion: Array) -> tuple[Array, Array]:
    """Rotation matrix and translation."""
    if isinstance(rigid, SE2):
        c, s = np.cos(motion[2]), np.sin(motion[2])
        return np.array([[c, -s], [s, c]]), motion[:2]
    return rotation_matrix(motion[:4]), motion[4:]


def _composed(rigid: Manifold, motion: Array, value: Array) -> Array:
    """motion ∘ value."""
    return rigid.retract(np.broadcast_to(motion, value.shape), rigid.local(rigid.identity(), value))
