"""Is the board flat?  What a bent one would explain of a calibration, said where it matters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.adjustment import Unknowns, adjust
from vision3d.calibrate.calibration import Calibration
from vision3d.calibrate.covariance import covariances
from vision3d.calibrate.look_alikes import groups_of
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.robust import weights_of

__all__ = ["with_flatness"]

Array = NDArray[np.float64]

BENT = 3.0
"""Standard deviations from which a bend is spoken of."""
WORTH = 0.98
"""… if it brings the cost down to this share of that of a flat board, or less."""


def with_flatness(found: Calibration) -> Calibration:
    """Add a finding where the corners of views err together and a bent board explains a part of it."""
    if found.inflation <= 1.0 or any(np.ptp(view.points[:, 2]) > 0.0 for view in found.views):
        return found
    problem = Problem.of(found.views, found.floor_px, found.sigma_scale)
    weights = weights_of(problem, np.concatenate(found.weights))
    begun = Unknowns(found.camera.lens, found.camera.parameters, found.warp, found.poses)
    solution = adjust(problem, begun, weights, np.ones(found.camera.count + 2, dtype=bool))
    flat = 0.5 * float(np.sum(weights[:, None] * np.concatenate(found.residuals) ** 2))
    if solution.blocks.cost(weights) > WORTH * flat:
        return found
    free = np.ones(found.camera.count + 2, dtype=bool)
    known = covariances(solution.blocks, free, found.sigma_scale, groups_of(found.views))
    warp, std = solution.unknowns.warp, np.sqrt(np.diag(known.joint)[-2:])
    axis = int(np.argmax(np.abs(warp) / std))
    if abs(warp[axis]) < BENT * std[axis]:
        return found
    rise, spread = 1e3 * abs(warp[axis]), 1e3 * std[axis]
    words = (
        f"a bent board explains a part of what is left: along its {'columns' if axis else 'rows'} the middle "
        f"stands {rise:.2f} ± {spread:.2f} mm off the ends; glue it to a rigid plate "
        "(in Python, calibrate(…, board_warp=True) takes the bend into account)"
    )
    told = found.report
    told = replace(told, findings=(*told.findings, words), remarks=(*told.remarks, words))
    return replace(found, report=told)
