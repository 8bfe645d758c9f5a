"""Filter and smoother on the same frames: how sure each says it is, and whether the filter keeps its word."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.filter import FilterRun
from factorlab.marker_map.mapping import MarkerMap
from sequential.manifold import SE3, rotation_matrix

__all__ = ["Beside", "beside"]

Array = NDArray[np.float64]
MANIFOLD = SE3()
SETTLED_S = 2.0  # a filter's first seconds are not counted
CHI2_6 = 22.46  # that a pose exceeds once in a thousand


@dataclass(frozen=True, eq=False)
class Beside:
    """The frames that both have, after the filter's first two seconds.

    Parameters
    ----------
    t : (K,) ns
    apart : (K, 6) from the filter's pose to the smoother's, in the tangent at the filter's: rad, m
    filter_sigma, smoother_sigma : (K, 2) of orientation (rad) and place (m), roots of traces
    covered : share of frames whose smoothed pose lies within the filter's 99.9 %
    place_apart : (K, 3) in the world, with the filter's own sigmas (K, 3)
    """

    t: NDArray[np.int64]
    apart: Array
    filter_sigma: Array
    smoother_sigma: Array
    covered: float
    place_apart: Array
    place_sigma: Array

    @property
    def apart_m(self) -> float:
        """Root mean square distance between their places."""
        return float(np.sqrt(np.mean(np.sum(self.apart[:, 3:] ** 2, axis=1))))


def beside(found: MarkerMap, filtered: FilterRun) -> Beside | None:
    """Compare; None where they share no settled frame.

    A smoother knows all that the filter knew, so the difference of their poses has the covariance of the
    filter less that of the smoother: what lies beyond the filter's own is more than it may be off by.
    """
    t = found.sightings.t
    settled = t[filtered.frames] >= t[filtered.frames[0]] + round(SETTLED_S * 1e9)
    settled &= np.isfinite(filtered.poses[:, 0])
    frames, own, other = np.intersect1d(filtered.frames[settled], found.frames, return_indices=True)
    if not len(frames):
        return None
    rows = np.flatnonzero(settled)[own]
    pose, cov = filtered.poses[rows], filtered.covs[rows, :6, :6]
    apart = MANIFOLD.local(pose, found.trajectory[other])
    squared = np.einsum("ki,ki->k", apart, np.linalg.solve(cov, apart[..., None])[..., 0])
    R = rotation_matrix(pose[:, :4])
    world = R @ cov[:, 3:, 3:] @ R.transpose(0, 2, 1)
    return Beside(
        t[frames],
        apart,
        _sigmas(cov),
        _sigmas(found.frame_covs[other, :6, :6]),
        float(np.mean(squared < CHI2_6)),
        found.trajectory[other, 4:] - pose[:, 4:],
        np.sqrt(np.einsum("kii->ki", world)),
    )


def _sigmas(cov: Array) -> Array:
    """(K, 2) of orientation and place."""
    blocks = (cov[:, :3, :3], cov[:, 3:, 3:])
    sigmas: Array = np.sqrt(np.stack([np.trace(block, axis1=1, axis2=2) for block in blocks], axis=1))
    return sigmas
