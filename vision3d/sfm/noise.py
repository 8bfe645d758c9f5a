"""How large the noise of the pixels is, as the residuals of a reconstruction tell it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["noise_of"]

POSE, POINT, GAUGE = 6, 3, 7
MAD_OF_NORMAL = 0.6744897501960817


def noise_of(found: Reconstruction) -> float:
    """Standard deviation of a pixel coordinate, px: robust, and for the degrees of freedom of the fit.

    Half of the residuals lie within 0.6745 sigma of a normal distribution; a fit with many unknowns draws
    residuals towards zero, by the root of the share of equations that it uses up.  1 where there is too
    little to tell.
    """
    residuals = found.residuals()
    residuals = residuals[np.isfinite(residuals).all(axis=1)]
    equations = residuals.size
    unknowns = POSE * len(found) + POINT * len(found.points) - GAUGE + sum(c.count - 3 for c in found.cameras)
    if equations < 20 or equations <= unknowns:
        return 1.0
    spread = float(np.median(np.abs(residuals))) / MAD_OF_NORMAL
    return max(spread * float(np.sqrt(equations / (equations - unknowns))), 1e-6)
