"""Where an image was taken from: the pose by points that it sees, wrong ones among them."""

from __future__ import annotations

import numpy as np

from sequential.errors import FactorlabError
from vision3d.robust import RansacSettings
from vision3d.robust.pose import fit_pose
from vision3d.sfm.growth import Growth

__all__ = ["place_image"]

LEAST_SHARE = 0.25
"""Of the points that an image should see, so many have to agree: fewer, and it may show something alike."""


def place_image(growth: Growth, image: int) -> bool:
    """Give an image its pose; False where too few of its points agree on one."""
    tracks, settings = growth.tracks, growth.settings
    mine = np.flatnonzero((tracks.images == image) & np.isfinite(growth.points[tracks.tracks, 0]))
    try:
        found = fit_pose(
            growth.camera(image),
            growth.points[tracks.tracks[mine]],
            tracks.pixels[mine],
            RansacSettings(threshold=settings.error_px),
            rng=growth.rng,
        )
    except FactorlabError:
        return False
    if found.count < max(settings.least_inliers, LEAST_SHARE * len(mine)):
        return False
    growth.poses[image] = found.model
    growth.fits[mine] = growth.errors()[mine] <= settings.error_px
    return True
