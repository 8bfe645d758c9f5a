"""How sure the places of cameras are, in the unit of the model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factorlab.sfm.job import SfmDone
from vision3d.sfm import Reconstruction

__all__ = ["place_sigmas", "typical_distance"]


def place_sigmas(done: SfmDone) -> NDArray[np.float64] | None:
    """(V,) root of the mean variance of a coordinate of every camera's place; None where it is not known.

    Their gauge is that of all centres: place, attitude and size of the cloud of cameras are taken as known.
    """
    if done.adjusted is None or done.adjusted.centre_covs is None:
        return None
    covs = done.adjusted.centre_covs[:, 3:, 3:]
    sigmas: NDArray[np.float64] = np.sqrt(np.trace(covs, axis1=1, axis2=2) / 3.0)
    return sigmas


def typical_distance(found: Reconstruction) -> float:
    """Median distance from a camera to a point that it sees."""
    return float(np.median(np.linalg.norm(found.points_in_cameras(), axis=1)))
