"""Tracks: features of several images that matches join, and that are taken for one point of space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError

__all__ = ["Tracks", "build_tracks"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Tracks:
    """Observations (K,) sorted by track, then by image; no image is twice in a track.

    Parameters
    ----------
    images, features : (K,) image, and row among its features
    tracks : (K,) number of the track, 0 to T − 1
    pixels : (K, 2) where
    count : T
    """

    images: Integers
    features: Integers
    tracks: Integers
    pixels: Array
    count: int

    @property
    def lengths(self) -> Integers:
        """(T,) how many images see each."""
        return np.bincount(self.tracks, minlength=self.count).astype(np.int64)


def build_tracks(
    pixels: Sequence[Array], matches: Mapping[tuple[int, int], Integers], *, least: int = 2
) -> Tracks:
    """Join matches to tracks.

    Parameters
    ----------
    pixels : of every image its features (N, 2)
    matches : for pairs of images (a, b) the rows (M, 2) of features that belong together
    least : tracks of fewer images are left out

    Where matches join two features of one image, one of them is wrong: such tracks are joined again, pairs
    with most matches first, and what would bring in a second feature of an image is left out.

    Raises
    ------
    ShapeError
        where a match names a feature that does not exist.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first = np.concatenate([[0], np.cumsum([len(rows) for rows in pixels])]).astype(np.int64)
    edges = [np.zeros((0, 2), dtype=np.int64)]
    for (a, b), rows in sorted(matches.items(), key=lambda one: (-len(one[1]), one[0])):
        pairs = np.asarray(rows, dtype=np.int64).reshape(-1, 2)
        if len(pairs) and (
            (pairs < 0).any() or (pairs.max(axis=0) >= (len(pixels[a]), len(pixels[b]))).any()
        ):
            raise ShapeError(f"matches of images {a} and {b} name features that do not exist")
        edges.append(pairs + first[[a, b]])
    joined = np.concatenate(edges)
    size = int(first[-1])
    graph = coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    image = np.repeat(np.arange(len(pixels)), np.diff(first))
    twice = _twice(label, image)
    if twice.any():
        again = np.isin(label, label[twice])
        label = _parted(label, image, joined[again[joined[:, 0]]])
    kept = np.zeros(size, dtype=bool)
    kept[joined.ravel()] = True
    often = np.bincount(label[kept])
    kept[kept] = often[label[kept]] >= least
    at = np.flatnonzero(kept)
    at = at[np.lexsort((image[at], label[at]))]
    _, number = np.unique(label[at], return_inverse=True)
    places = np.concatenate([np.zeros((0, 2)), *pixels])
    count = int(number.max()) + 1 if len(number) else 0
    return Tracks(
        image[at].astype(np.int64), at - first[image[at]], number.astype(np.int64), places[at], count
    )


def _twice(label: Integers, image: Integers) -> NDArray[np.bool_]:
    """Whether another feature of the same image is in the same track."""
    key = label.astype(np.int64) * (int(image.max(initial=0)) + 1) + image
    _, of, often = np.unique(key, return_inverse=True, return_counts=True)
    return np.asarray(often[of] > 1, dtype=bool)


def _parted(label: Integers, image: Integers, edges: Integers) -> Integers:
    """Labels after the features of some edges (E, 2), the surest first, are joined with no image twice."""
    own = {int(feature): {int(image[feature])} for feature in np.unique(edges)}
    root = {feature: feature for feature in own}

    def find(feature: int) -> int:
        while root[feature] != feature:
            root[feature] = feature = root[root[feature]]
        return feature

    for one, other in edges.tolist():
        first, second = find(one), find(other)
        if first != second and own[first].isdisjoint(own[second]):
            root[second] = first
            own[first] |= own[second]
    parted = label.astype(np.int64)
    fresh = int(label.max()) + 1
    for feature in own:
        parted[feature] = fresh + find(feature)
    return parted
