"""Whether the pictures ask for a second radial coefficient.

A mapper does best with one coefficient, which a few pictures determine; once the model stands, a second is
free where the cost falls by more than the Bayesian information criterion asks (Schwarz 1978), three times
over, and by more than a fiftieth: what is less is not worth a number that nobody has asked for.
"""

from __future__ import annotations

import numpy as np

from vision3d.camera import Camera
from vision3d.sfm.adjustment import cost_of
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.settling import adjusted

__all__ = ["with_second_coefficient"]

STRICT, WORTH = 3.0, 0.02
FEWEST, ENOUGH = 3, 200  # pictures and points, below which there is no choice to make


def with_second_coefficient(found: Reconstruction, soft_px: float) -> Reconstruction | None:
    """The model with the lenses `brown1` made `brown2`; None where one coefficient does.

    Parameters
    ----------
    soft_px : scale of the soft-L1 loss that it was adjusted with
    """
    if (
        len(found) < FEWEST
        or len(found.points) < ENOUGH
        or any(camera.lens != "brown1" for camera in found.cameras)
    ):
        return None
    cameras = tuple(
        Camera("brown2", one.intrinsics, (*one.distortion, 0.0), one.size) for one in found.cameras
    )
    larger = adjusted(found.replaced(cameras=cameras, models=("RADIAL",) * len(cameras)), soft_px=soft_px)
    if any(camera.check_monotonic().inside for camera in larger.cameras):
        return None
    before, after = (cost_of(one.residuals(), "soft_l1", soft_px)[0] for one in (found, larger))
    equations = found.pixels.size
    asked = STRICT * len(cameras) * np.log(equations) / equations
    return larger if np.log(before / after) > max(asked, WORTH) else None
