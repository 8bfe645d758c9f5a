"""Motions of a whole state that have a name: what readings may fail to show, said as a navigator would.

A symmetry is a tangent direction at one state: a component by itself, a pose turned about a landmark or about
the vertical, a pose carried along an axis of the world.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE2, SE3, Manifold, NavState, Product
from sequential.manifold.quaternion import rotation_matrix
from sequential.model import StateSpace

__all__ = ["Symmetry", "pivoted", "symmetries", "turning_point"]

Array = NDArray[np.float64]

WORLD = "xyz"
ALONE = 1e-3  # what a turn of a pose may have beside it


class Symmetry(NamedTuple):
    """A direction (d,) and what it is called."""

    words: str
    direction: Array


class Place(NamedTuple):
    """A pose inside a state."""

    name: str  # "" where it is the whole state
    member: Manifold
    storage: int
    tangent: int


def symmetries(model: StateSpace, x: Array) -> Iterator[Symmetry]:
    """The named directions at a state (n,), simplest first."""
    d, places = model.manifold.dim, list(_places(model.manifold))
    for place in places:
        if not isinstance(place.member, SE2):
            yield _heading(model, place, x)
    for j, label in enumerate(model.manifold.labels()):
        yield Symmetry(label, np.eye(d)[j])
    for place in places:
        yield from _of_plane(model, place, x) if isinstance(place.member, SE2) else _of_space(model, place, x)


def _places(manifold: Manifold) -> Iterator[Place]:
    if isinstance(manifold, Product):
        for name, member in manifold.parts.items():
            if isinstance(member, SE2 | SE3 | NavState):
                yield Place(name, member, manifold.storage(name).start, manifold.tangent(name).start)
    elif isinstance(manifold, SE2 | SE3 | NavState):
        yield Place("", manifold, 0, 0)


def _of_plane(model: StateSpace, place: Place, x: Array) -> Iterator[Symmetry]:
    """Along the axes of the world, and about every landmark."""
    at, who = place.storage, place.name or "the pose"
    c, s = np.cos(x[at + 2]), np.sin(x[at + 2])
    body_R_world = np.array([[c, s], [-s, c]])
    for axis in range(2):
        yield _put(model, place, f"{who} moves along world {WORLD[axis]}", body_R_world[:, axis])
    for name, index, landmark in _landmarks(model, 2):
        arm = x[at : at + 2] - landmark
        moved = body_R_world @ np.array([-arm[1], arm[0]])
        words = f"{who} turns about landmark {index} of {name!r}, heading and position together"
        yield _put(model, place, words, np.array([*moved, 1.0]))


def _heading(model: StateSpace, place: Place, x: Array) -> Symmetry:
    axis = rotation_matrix(x[place.storage : place.storage + 4]).T @ _vertical(model)
    return _put(model, place, f"heading of {place.name or 'the body'}: it turns about the vertical", axis)


def _of_space(model: StateSpace, place: Place, x: Array) -> Iterator[Symmetry]:
    """About the vertical through the origin, and along the axes of the world."""
    who = place.name or "the body"
    body_R_world = rotation_matrix(x[place.storage : place.storage + 4]).T
    up = _vertical(model)
    axis = body_R_world @ up
    position = x[place.storage + 4 : place.storage + 7]
    whole = [axis, body_R_world @ np.cross(up, position)]
    if isinstance(place.member, NavState):
        whole.append(body_R_world @ np.cross(up, x[place.storage + 7 : place.storage + 10]))
    yield _put(model, place, f"{who} turns about the vertical through the origin", np.concatenate(whole))
    for k in range(3):
        moved = np.concatenate([np.zeros(3), body_R_world[:, k]])
        yield _put(model, place, f"{who} moves along world {WORLD[k]}", moved)
    for name in _vectors(model.manifold):
        direction = np.zeros(model.manifold.dim)
        direction[model.manifold.tangent(name)] = axis  # type: ignore[attr-defined]  # a product
        yield Symmetry(f"{name} along the vertical", direction)


def _vertical(model: StateSpace) -> Array:
    gravity = np.asarray(getattr(model.process, "gravity", (0.0, 0.0, -1.0)), dtype=np.float64)
    size = float(np.linalg.norm(gravity))
    return -gravity / size if size > 0 else np.array([0.0, 0.0, 1.0])


def _vectors(manifold: Manifold) -> list[str]:
    """Parts that hold a vector in the body's axes, as biases are."""
    parts = manifold.parts if isinstance(manifold, Product) else {}
    return [name for name, member in parts.items() if member.size == member.dim == 3]


def _landmarks(model: StateSpace, axes: int) -> Iterator[tuple[str, int, Array]]:
    for name, sensor in model.sensors.items():
        known = getattr(sensor, "landmarks", None)
        if known is not None and np.shape(known)[1] == axes:
            for index, landmark in enumerate(np.asarray(known, dtype=np.float64)):
                yield name, index, landmark


def _put(model: StateSpace, place: Place, words: str, values: Array) -> Symmetry:
    direction = np.zeros(model.manifold.dim)
    direction[place.tangent : place.tangent + len(values)] = values
    return Symmetry(words, direction)


def turning_point(model: StateSpace, x: Array, direction: Array) -> str | None:
    """`pose turns about (1.2, 3.4)`, where a direction is a turn of a planar pose about some point."""
    for place in _places(model.manifold):
        own = direction[place.tangent : place.tangent + place.member.dim]
        alone = np.linalg.norm(own) > (1.0 - ALONE) * np.linalg.norm(direction)
        if not isinstance(place.member, SE2) or not alone or own[2] == 0.0:
            continue
        heading = x[place.storage + 2]
        c, s = np.cos(heading), np.sin(heading)
        vx, vy = np.array([[c, -s], [s, c]]) @ own[:2] / own[2]
        point = (x[place.storage] - vy, x[place.storage + 1] + vx)
        return f"{place.name or 'the pose'} turns about ({point[0]:.3g}, {point[1]:.3g})"
    return None


def pivoted(basis: Array) -> Array:
    """Another basis of the same space (d, k) with as many zeros as a choice of k components allows."""
    remaining = basis.copy()
    pivots: list[int] = []
    for _ in range(basis.shape[1]):
        sizes = np.linalg.norm(remaining, axis=1)
        sizes[pivots] = -1.0
        pivots.append(int(np.argmax(sizes)))
        row = remaining[pivots[-1]] / np.linalg.norm(remaining[pivots[-1]])
        remaining = remaining - np.outer(remaining @ row, row)
    return np.asarray(basis @ np.linalg.inv(basis[pivots]))
