"""Directions of a state in words: which parts and components they mix, and in what proportion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import Manifold

__all__ = ["in_words", "invariant_kernel"]

Array = NDArray[np.float64]

SMALL = 0.1  # components below this share of the largest are left out of a name
CLOSE = 1e-9  # relative size below which a mapping counts as zero


def in_words(manifold: Manifold, direction: Array) -> str:
    """A tangent direction (d,) as `0.71 x0 + 0.71 x1`, by the component names of its parts.

    The sign is chosen so that the largest component is positive; small components are left out.
    """
    weights = np.asarray(direction, dtype=np.float64)
    weights = weights / max(float(np.linalg.norm(weights)), 1e-300)
    largest = int(np.argmax(np.abs(weights) > 0.999 * np.abs(weights).max()))
    weights = weights * np.sign(weights[largest])
    shown = [
        (w, name)
        for w, name in zip(weights, manifold.labels(), strict=True)
        if abs(w) >= SMALL * np.abs(weights).max()
    ]
    if len(shown) == 1:
        return shown[0][1]
    first, *others = shown
    lead = "-" if first[0] < 0 else ""
    words = [f"{lead}{abs(first[0]):.2g} {first[1]}"]
    words += [f"{'-' if w < 0 else '+'} {abs(w):.2g} {name}" for w, name in others]
    return " ".join(words)


def invariant_kernel(transition: Array, matrix: Array) -> Array:
    """The largest subspace that F maps into itself and H maps to zero, as columns (n, k).

    With (F, H) it is what never shows in the readings; with (Fᵀ, Gᵀ) what no noise ever reaches, seen
    from the left.  Decided by singular values, not by eigenvalues, which chains of integrators blur.
    """
    norm = max(float(np.linalg.norm(transition, 2)), 1e-300)
    basis = _kernel(matrix, np.eye(len(transition)), float(np.linalg.norm(matrix, 2)))
    while basis.shape[1]:
        moved = transition @ basis
        leaves = moved - basis @ (basis.T @ moved)
        smaller = _kernel(leaves, basis, norm)
        if smaller.shape[1] == basis.shape[1]:
            break
        basis = smaller
    return basis


def _kernel(mapped: Array, basis: Array, norm: float) -> Array:
    """What of a basis (n, k) an image of it, `mapped` (m, k), has lost."""
    _, sizes, turned = np.linalg.svd(mapped)
    kept = np.ones(len(turned), dtype=bool)
    kept[: len(sizes)] = sizes <= CLOSE * max(norm, 1e-300)
    return np.asarray(basis @ turned[kept].T)
