"""Observations a reconstruction is better without: far from their prediction, or of points nobody places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.sfm.geometry import triangulation_angles
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["Filtered", "filter_observations"]


@dataclass(frozen=True, eq=False)
class Filtered:
    """A reconstruction without some of its observations, and how many went for which reason.

    Parameters
    ----------
    reconstruction : what is left; points that fewer than two images see went with the rest
    kept : (K,) which observations of the one that was given are left
    far, behind, narrow, alone : observations that went: beyond the error allowed, of points behind their
        camera, of points whose rays are nearly parallel, and of points that no second image sees
    """

    reconstruction: Reconstruction
    kept: NDArray[np.bool_]
    far: int
    behind: int
    narrow: int
    alone: int


def filter_observations(
    reconstruction: Reconstruction, *, max_error_px: float = 4.0, min_angle_rad: float = 0.0
) -> Filtered:
    """Leave out what cannot be right.

    Parameters
    ----------
    reconstruction : to be cleaned
    max_error_px : farther from its prediction an observation goes
    min_angle_rad : a point goes whose widest angle between two rays is smaller
    """
    errors = reconstruction.errors_px()
    behind = ~np.isfinite(errors)
    far = np.where(behind, 0.0, errors) > max_error_px
    kept = ~(behind | far)
    alone = (
        kept
        & (np.bincount(reconstruction.point_index[kept], minlength=len(reconstruction.points)) < 2)[
            reconstruction.point_index
        ]
    )
    kept &= ~alone
    narrow = np.zeros_like(kept)
    if min_angle_rad > 0.0 and kept.any():
        angles = np.zeros(len(reconstruction.points))
        cleaned = reconstruction.selected(kept)
        seen = np.unique(reconstruction.point_index[kept])
        angles[seen] = triangulation_angles(cleaned)
        narrow = kept & (angles < min_angle_rad)[reconstruction.point_index]
        kept &= ~narrow
    return Filtered(
        reconstruction.selected(kept), kept, *(int(gone.sum()) for gone in (far, behind, narrow, alone))
    )
