"""Parts beside a navigation state, such as a barometer's bias or a lever arm: one variable, or one a node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.keys import WALKING, S, walking
from sequential.manifold import Product, Vector
from sequential.model import StateSpace
from sequential.models import Strapdown
from sequential.models.parts import walk_variances

__all__ = ["Other", "known_layout", "number_or_vector", "one_of", "others"]

Array = NDArray[np.float64]


class Other(NamedTuple):
    """A vector part beside the navigation state: one variable, or one at each node."""

    name: str
    storage: slice
    tangent: slice
    key: Callable[[int], int]
    static: bool
    variance: Array  # (size,) per second, of its walk


def others(model: StateSpace, process: Strapdown) -> list[Other]:
    """Parts beside the navigation state and the biases."""
    manifold, found, moving = model.manifold, list[Other](), 0
    variances = walk_variances(manifold, process.walks, 15, "Strapdown")
    for name in list(manifold.parts)[3:]:  # type: ignore[attr-defined]
        storage, tangent = manifold.storage(name), manifold.tangent(name)  # type: ignore[attr-defined]
        static = name in model.static
        if static:
            key = static_key(len(found))
        else:
            key, moving = walking_key(moving), moving + 1
        found.append(Other(name, storage, tangent, key, static, variances[tangent]))
    return found


def static_key(part: int) -> Callable[[int], int]:
    """The same at every node."""
    key = S(part)
    return lambda k: key  # noqa: ARG005


def walking_key(part: int) -> Callable[[int], int]:
    """One at each node."""
    return lambda k: walking(part, k)


def number_or_vector(values: Array) -> Any:
    """GTSAM keeps single numbers apart from vectors."""
    return float(values[0]) if len(values) == 1 else np.array(values)


def one_of(kind: str, other: Other) -> Any:
    """`PriorFactorDouble` and the like."""
    return getattr(gtsam, kind + ("Double" if len(other.variance) == 1 else "Vector"))


def known_layout(model: StateSpace, process: Strapdown) -> bool:
    """Whether what stands beside the navigation state are vectors that are static, or walk in all directions.

    The prior must not tie them to the rest, which separate factors cannot say.
    """
    manifold = model.manifold
    if not isinstance(manifold, Product):
        return False
    beside = list(manifold.parts)[3:]
    if not set(model.static) <= set(beside) or len(beside) > len(WALKING):
        return False
    variances, cov = walk_variances(manifold, process.walks, 15, "Strapdown"), np.array(model.prior.cov)
    for name in beside:
        own = manifold.tangent(name)
        cov[own, own] = 0.0
    if np.any(cov[15:]):
        return False
    return all(
        isinstance(manifold.part(name), Vector)
        and (variances[manifold.tangent(name)] > 0).all() != (name in model.static)
        for name in beside
    )
