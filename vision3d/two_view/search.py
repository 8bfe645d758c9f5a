"""The best essential matrix, homography and rotation of pairs of rays, by the robust loop."""

from __future__ import annotations

import numpy as np

from sequential.errors import UnderConstrainedError
from vision3d.camera import Array
from vision3d.robust.rays import ESSENTIAL, RAY_HOMOGRAPHY, ROTATION
from vision3d.robust.search import Found, search
from vision3d.robust.settings import RansacSettings

__all__ = ["search_rays"]

CONFIDENCE, INNER_SAMPLES, BUDGET = 0.9999, 10, 20_000


def search_rays(rows: Array, kind: str, threshold: float, rng: np.random.Generator) -> Found | None:
    """The best "essential", "homography" or "rotation" of rows (N, 18); None where no sample has one."""
    model = {"essential": ESSENTIAL, "homography": RAY_HOMOGRAPHY, "rotation": ROTATION}[kind]
    settings = RansacSettings(
        threshold,
        confidence=CONFIDENCE,
        max_iterations=BUDGET,
        inner_samples=INNER_SAMPLES,
        refine="msac",
    )
    try:
        return search(model, rows, settings, np.ones(len(rows)), rng)
    except UnderConstrainedError:
        return None
