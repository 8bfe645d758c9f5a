"""Where a model finds its part of the state: offsets into a product manifold, mounts, walks of its parts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold import SO3, Manifold, Product, Vector

__all__ = ["find_part", "mounted", "named_vector", "walk_variances"]

Array = NDArray[np.float64]


def find_part(
    manifold: Manifold, kinds: tuple[type[Manifold], ...], name: str | None, who: str
) -> tuple[int, int, Manifold]:
    """Storage start, tangent start and manifold of a part.

    Without a name: the whole state, or the first part of one of the wanted kinds.

    Raises
    ------
    ModelError
        where there is no such part.
    """
    if not isinstance(manifold, Product):
        if name is None and isinstance(manifold, kinds):
            return 0, 0, manifold
    else:
        for part, member in manifold.parts.items():
            if (name is None or part == name) and isinstance(member, kinds):
                return manifold.storage(part).start, manifold.tangent(part).start, member
    wanted = " or ".join(kind.__name__ for kind in kinds)
    what = f"a part {name!r} that is a {wanted}" if name else f"a state, or a part of one, that is a {wanted}"
    msg = f"{who} needs {what}; the state is {manifold}"
    raise ModelError(msg)


def named_vector(manifold: Manifold, name: str | None, size: int, who: str) -> tuple[int, int, int]:
    """1, storage start and tangent start of a vector part of `size` numbers; zeros where none is named.

    Raises
    ------
    ModelError
    """
    if name is None:
        return 0, 0, 0
    storage, tangent, part = find_part(manifold, (Vector,), name, who)
    if part.size != size:
        numbers = "1 number is" if size == 1 else f"{size} numbers are"
        msg = f"{who} {name!r} has {part.size} numbers; {numbers} expected"
        raise ModelError(msg)
    return 1, storage, tangent


def walk_variances(manifold: Manifold, walks: Mapping[str, ArrayLike] | None, taken: int, who: str) -> Array:
    """(d,) what the variance of each tangent direction gains per second, from walks (unit/√s) of named parts.

    Parameters
    ----------
    taken : tangent directions at the front that the process moves itself, and that may not be named

    Raises
    ------
    ModelError
    """
    found = np.zeros(manifold.dim)
    for name, density in (walks or {}).items():
        parts = list(getattr(manifold, "parts", {}))
        if name not in parts:
            msg = f"{who} is to let {name!r} walk, which is no part of the state; it has {parts or 'none'}"
            raise ModelError(msg)
        where = manifold.tangent(name)  # type: ignore[attr-defined]
        if where.start < taken:
            msg = f"{who} moves {name!r} itself; walks are for the parts that would otherwise stand still"
            raise ModelError(msg)
        given = np.asarray(density, dtype=np.float64)
        if not (np.isfinite(given).all() and (given >= 0).all()):
            msg = f"{who}'s walk of {name!r} is {given}; a density is a finite number, zero or more"
            raise ModelError(msg)
        found[where] = given**2
    return found


def mounted(given: ArrayLike | None, manifold: Manifold, who: str) -> Array:
    """Where a sensor sits in the body, checked and read-only: (4,), (7,) or (3,); at the body unless given.

    Raises
    ------
    ShapeError, DataError, NotFiniteError
    """
    if given is None:
        own = manifold.identity()
    else:
        own = np.array(given, dtype=np.float64)
        if own.shape != (manifold.size,):
            what = "quaternion (4,)" if isinstance(manifold, SO3) else f"pose ({manifold.size},)"
            raise ShapeError(f"{who} is a {what}, got shape {own.shape}")
        manifold.check(own)
        own = manifold.normalize(own)
    own.flags.writeable = False
    return own
