"""The best essential matrix, homography and rotation of pairs of rays, by the robust loop."""

from __future__ import annotations

import numpy as np

from sequential.errors import UnderConstrainedError
from vision3d.camera import Array
from vision3d.robust.rays import ESSENTIAL, RAY_HOMOGRAPHY, ROTATION
from vision3d.robust.search import Found, search
from vision3d.robust.settings import RansacSettings

__all__ = ["samples_for", "search_rays"]

FEWEST = 50

CONFIDENCE, INNER_SAMPLES = 0.9999, 10
MODELS = {"essential": ESSENTIAL, "homography": RAY_HOMOGRAPHY, "rotation": ROTATION}


def search_rays(
    rows: Array,
    kind: str,
    threshold: float,
    rng: np.random.Generator,
    *,
    budget: int,
    best_first: bool = False,
) -> Found | None:
    """The best "essential", "homography" or "rotation" of rows (N, 18); None where no sample has one."""
    settings = RansacSettings(
        threshold,
        confidence=CONFIDENCE,
        max_iterations=budget,
        order="prosac" if best_first else "as given",
        inner_samples=INNER_SAMPLES,
        refine="msac",
    )
    try:
        return search(MODELS[kind], rows, settings, np.ones(len(rows)), rng)
    except UnderConstrainedError:
        return None


def samples_for(share: float, kind: str, most: int) -> int:
    """Samples that find a model which a share of the rows agrees with, or `most`."""
    good = share ** MODELS[kind].sample_size
    if not good * most > 1.0:
        return most
    return int(np.clip(np.log(1.0 - CONFIDENCE) / np.log1p(-min(good, 0.999)), FEWEST, most))
