"""Which feature of one image is which of the other: the nearest descriptor, if it is clearly the nearest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError
from vision3d.features.features import Array, Features, Matches

__all__ = ["APART_PX", "descriptor_table", "match_features", "match_table"]

AT_ONCE = 4_000_000  # distances held in memory
APART_PX = 10.0


def match_features(
    a: Features,
    b: Features,
    *,
    ratio: float | None = 0.8,
    cross_check: bool = True,
    apart_px: float = APART_PX,
) -> Matches:
    """Match by brute force: Hamming's distance of bits, Euclid's of numbers.

    Parameters
    ----------
    a, b : features of one kind
    ratio : keep where the nearest descriptor is nearer than this times the second (Lowe, 2004); None: all
    cross_check : keep where each is the other's nearest
    apart_px : the second must be this far from the nearest in the image, else it is the same thing found
        twice and says nothing (Mishkin, Matas and Perdoch, 2015); 0: any second counts

    Returns
    -------
    Matches
        the most distinctive first.

    Raises
    ------
    DataError
        where the features cannot be compared.
    ModelError
        where the ratio is not in 0 to 1.
    """
    if ratio is not None and not 0.0 < ratio <= 1.0:
        raise ModelError(f"the ratio test takes a ratio above 0 and up to 1, or None; got {ratio}")
    if a.binary != b.binary or a.descriptors.shape[1] != b.descriptors.shape[1]:
        told = [f"{f.kind or 'features'} of {f.descriptors.shape[1]} {f.descriptors.dtype}" for f in (a, b)]
        raise DataError(f"{told[0]} cannot be compared with {told[1]}; detect the same kind in both images")
    return match_table(a, b, ratio=ratio, cross_check=cross_check, apart_px=apart_px)


def match_table(
    a: Features,
    b: Features,
    *,
    ratio: float | None,
    cross_check: bool,
    apart_px: float,
    gate: Callable[[slice], NDArray[np.bool_]] | None = None,
) -> Matches:
    """The same without checks, among pairs that `gate` allows: rows of a -> (rows, M) whether they may be."""
    if not len(a) or not len(b):
        return Matches(np.empty((0, 2), np.int64), np.empty(0), np.empty(0))
    best, nearest, second, best_of_b = _nearest(a, b, apart_px, gate)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(second > 0.0, nearest / second, 1.0)
    keep = best >= 0
    if cross_check:
        keep &= best_of_b[np.maximum(best, 0)] == np.arange(len(a))
    if ratio is not None:
        keep &= ratios < ratio
    rows = np.flatnonzero(keep)
    rows = rows[np.lexsort((nearest[rows], ratios[rows]))]
    return Matches(np.column_stack([rows, best[rows]]), nearest[rows], ratios[rows])


def _nearest(
    a: Features, b: Features, apart_px: float, gate: Callable[[slice], NDArray[np.bool_]] | None
) -> tuple[NDArray[np.int64], Array, Array, NDArray[np.int64]]:
    """Nearest row of b, its distance, that of the second, and the nearest row of a for each of b."""
    from vision3d.kernels.nearest import two_nearest

    n, m = len(a), len(b)
    best, best_of_b = np.empty(n, np.int64), np.full(m, -1)
    nearest, second, nearest_of_b = np.empty(n), np.empty(n), np.full(m, np.inf)
    table_of = _bits_apart if a.binary else _squares_apart
    step = max(1, AT_ONCE // m)
    for start in range(0, n, step):
        table = table_of(a.descriptors[start : start + step], b.descriptors)
        if gate is not None:
            table[~gate(slice(start, start + step))] = np.inf
        two_nearest(table, b.pixels, apart_px, start, best, nearest, second, best_of_b, nearest_of_b)
    if not a.binary:
        nearest, second = np.sqrt(nearest), np.sqrt(second)
        # a sum of three large terms rounds; the distance of the pair itself need not
        own = np.linalg.norm(a.descriptors.astype(np.float64) - b.descriptors[best], axis=1)
        nearest = np.where(best >= 0, own, nearest)
        second = np.maximum(second, nearest)
    return best, nearest, second, best_of_b


def descriptor_table(a: NDArray[Any], b: NDArray[Any]) -> Array:
    """Distances (N, M) between all rows of descriptors: bits, or Euclidean."""
    if a.dtype == np.uint8:
        return _bits_apart(a, b).astype(np.float64)
    return np.asarray(np.sqrt(_squares_apart(a, b)), dtype=np.float64)


def _bits_apart(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> NDArray[np.float32]:
    from vision3d.kernels.nearest import hamming

    out = np.empty((len(a), len(b)), np.float32)
    hamming(_words(a), _words(b), out)
    return out


def _words(rows: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Rows of bytes as words of 64 bits, filled up with zeros."""
    short = -rows.shape[1] % 8
    return np.ascontiguousarray(np.pad(rows, ((0, 0), (0, short)))).view(np.uint64)


def _squares_apart(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared Euclidean distances (N, M)."""
    table = a @ b.T
    table *= np.float32(-2.0)
    table += np.einsum("ij,ij->i", a, a)[:, None]
    table += np.einsum("ij,ij->i", b, b)[None, :]
    return np.asarray(np.maximum(table, np.float32(0.0)), dtype=np.float32)
