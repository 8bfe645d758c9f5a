"""A first map: which reading of each marker is right, decided by all frames that show two of them together.

The corners of one marker have two readings (`vision3d.markers.MarkerPose.modes`); the pose between
two markers is the same in every frame, and only the right pair of readings gives the same one every time.
So each pair of markers is put to the vote, and the winners are joined by the surest ways to the reference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from sequential.manifold import SE3
from vision3d.markers.sightings import MarkerSightings
from vision3d.rigid import compose, inverse

__all__ = ["MapStart", "Modes", "start_map"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
MANIFOLD = SE3()
MOST_VOTES = 32  # frames that vote on one pair
OUTLIER = 60.0  # squared sigmas of six beyond which a frame contradicts; covariances of modes are rough
WIDEN = 4.0  # times the covariance: two readings are compared, and neither is Gaussian far from facing
TURN_M = 0.3  # m a radian counts for in the length of a way


@dataclass(frozen=True, eq=False)
class Modes:
    """Readings of every sighting, camera_T_marker: poses (S, 2, 7), covs (S, 2, 6, 6), probability (S, 2)."""

    poses: Array
    covs: Array
    probability: Array

    @classmethod
    def of(cls, sightings: MarkerSightings) -> Modes:
        """Those of `MarkerSightings.poses`; a probability of zero where there is none."""
        count = len(sightings)
        poses = np.tile(MANIFOLD.identity(), (count, 2, 1))
        covs, probability = np.tile(np.eye(6), (count, 2, 1, 1)), np.zeros((count, 2))
        for k, pose in enumerate(sightings.poses):
            for j, mode in enumerate(() if pose is None else pose.modes):
                poses[k, j], covs[k, j], probability[k, j] = (
                    mode.camera_T_marker,
                    mode.cov,
                    mode.probability,
                )
        return cls(poses, covs, probability)


@dataclass(frozen=True, eq=False)
class MapStart:
    """Poses in the frame of the reference marker.

    Parameters
    ----------
    reference : row of the marker
    poses : (M, 7) reference_T_marker; only those of `placed` mean something
    placed : (M,) whether a chain of pairs leads to the marker
    """

    reference: int
    poses: Array
    placed: NDArray[np.bool_]


def start_map(sightings: MarkerSightings, modes: Modes, reference: int | None = None) -> MapStart:
    """Vote on all pairs, and join them; the reference is by default the marker that most others hang on."""
    count = len(sightings.ids)
    ways = np.full((count, count), np.inf)
    between: dict[tuple[int, int], Array] = {}
    rows = np.full((len(sightings.t), count), -1, dtype=np.int64)
    rows[sightings.frame, sightings.marker] = np.arange(len(sightings))
    usable = modes.probability[:, 0] > 0
    for a in range(count):
        for b in range(a + 1, count):
            both = np.flatnonzero((rows[:, a] >= 0) & (rows[:, b] >= 0))
            both = both[usable[rows[both, a]] & usable[rows[both, b]]]
            if not len(both):
                continue
            a_T_b, length = _vote(modes, rows[both, a], rows[both, b])
            between[a, b], between[b, a] = a_T_b, inverse(a_T_b)
            ways[a, b] = ways[b, a] = length
    weights = np.where(np.isfinite(ways), ways, 0.0)
    lengths, came_from = dijkstra(csr_matrix(weights), directed=False, return_predecessors=True)
    root = _root(lengths, sightings.counts) if reference is None else reference
    poses, placed = np.tile(MANIFOLD.identity(), (count, 1)), np.isfinite(lengths[root])
    for marker in np.argsort(lengths[root]):
        if marker != root and placed[marker]:
            before = int(came_from[root, marker])
            poses[marker] = compose(poses[before], between[before, int(marker)])
    return MapStart(root, poses, placed)


def _root(lengths: Array, counts: Ints) -> int:
    """The marker with most others within reach, by the shortest ways; the most seen of equals."""
    reached = np.isfinite(lengths)
    far = np.where(reached, lengths, 0.0).sum(axis=1)
    return int(np.lexsort((-counts, far, -reached.sum(axis=1)))[0])


def _vote(modes: Modes, first: Ints, second: Ints) -> tuple[Array, float]:
    """The pose between two markers that most frames agree on, and how unsure it is, in m."""
    if len(first) > MOST_VOTES:
        trust = modes.probability[first, 0] * modes.probability[second, 0]
        steady = 1.0 / np.trace(
            modes.covs[first, 0, 3:, 3:] + modes.covs[second, 0, 3:, 3:], axis1=1, axis2=2
        )
        groups = np.array_split(np.arange(len(first)), MOST_VOTES)  # spread over the recording
        chosen = np.array([group[np.argmax((trust * steady)[group])] for group in groups])
        first, second = first[chosen], second[chosen]
    pairs = [(i, j) for i in range(2) for j in range(2)]
    told = np.stack(
        [compose(inverse(modes.poses[first, i]), modes.poses[second, j]) for i, j in pairs], axis=1
    )  # (n, 4, 7)
    chance = np.stack([modes.probability[first, i] * modes.probability[second, j] for i, j in pairs], axis=1)
    covs = np.stack(
        [_between(told[:, k], modes.covs[first, i], modes.covs[second, j]) for k, (i, j) in enumerate(pairs)],
        axis=1,
    )
    whitening = np.linalg.inv(np.linalg.cholesky(WIDEN * covs))
    candidates = told[chance > 0]
    step = MANIFOLD.local(told[None], candidates[:, None, None])  # (C, n, 4, 6)
    squared = np.sum(np.einsum("nkij,cnkj->cnki", whitening, step) ** 2, axis=-1)
    with np.errstate(divide="ignore"):
        cost = np.minimum(squared - 2.0 * np.log(chance), OUTLIER).min(axis=2)
    best = int(np.argmin(cost.sum(axis=1)))
    agree = np.flatnonzero(cost[best] < OUTLIER)
    if not len(agree):
        return candidates[best], 10.0
    which = np.where(chance[agree] > 0, squared[best][agree], np.inf).argmin(axis=1)
    pose, cov = _mean(candidates[best], told[agree, which], covs[agree, which])
    length = float(np.sqrt(np.trace(cov[3:, 3:]) + TURN_M**2 * np.trace(cov[:3, :3])))
    doubt = len(first) / len(agree)  # frames that contradict make a way long
    return pose, length * doubt**2 + 1e-6


def _between(a_T_b: Array, cov_a: Array, cov_b: Array) -> Array:
    """Covariance (n, 6, 6) of a_T_b from those of camera_T_a and camera_T_b."""
    carry = MANIFOLD.transport(MANIFOLD.identity(), a_T_b)[0]
    total: Array = carry @ cov_a @ carry.transpose(0, 2, 1) + cov_b
    return total


def _mean(start: Array, poses: Array, covs: Array) -> tuple[Array, Array]:
    """Mean of poses by their information, and its covariance."""
    information = np.linalg.inv(covs)
    total, mean = information.sum(axis=0), start
    for _ in range(3):
        step = np.einsum("nij,nj->i", information, MANIFOLD.local(mean, poses))
        mean = MANIFOLD.retract(mean, np.linalg.solve(total, step))
    return mean, np.linalg.inv(total)
