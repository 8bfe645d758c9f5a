"""How much larger, or smaller, the noise of measurements is than declared, from what a fit leaves over.

    found = triangulate(camera, poses, pixels, sigma_px=0.1)
    sized = found.scaled(variance_factor(found.chi2[found.ok], found.dof[found.ok]))

Two views of a point leave one residual, across the epipolar line; over some hundred points these tell how
honest the declared sigmas are, and wrong matches among them must not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import DataError, ShapeError

__all__ = ["FEWEST", "variance_factor"]

FEWEST = 20
KEPT = 0.99
"""Share of honest values that is kept; the mean of the rest is corrected for it."""


def variance_factor(chi2: ArrayLike, dof: ArrayLike) -> float:
    """The variance of unit weight, robustly: 1 where the declared noise is right, 4 where it is double.

    Values beyond the quantile `KEPT` of their own distribution, scaled by the factor, are left out, and the
    mean of what is kept is divided by what it would be for factor 1.

    Parameters
    ----------
    chi2 : (N,) whitened sums of squares
    dof : (N,) their degrees of freedom, 1 or more

    Raises
    ------
    ShapeError
        where both are not of one length.
    DataError
        for fewer than `FEWEST` finite values.
    """
    from scipy.special import gammainc, gammaincinv

    values, free = np.asarray(chi2, dtype=np.float64), np.asarray(dof, dtype=np.float64)
    if values.ndim != 1 or values.shape != free.shape:
        raise ShapeError(f"chi2 and dof are (N,) both, got shapes {values.shape} and {free.shape}")
    known = np.isfinite(values) & (free >= 1)
    values, free = values[known], free[known]
    if len(values) < FEWEST:
        raise DataError(
            f"{len(values)} points with residuals say too little of their noise, {FEWEST} at least are needed"
        )
    cut = 2 * gammaincinv(free / 2, KEPT)
    expected = free * gammainc(free / 2 + 1, cut / 2) / KEPT
    # from the median, which bears wrong matches of up to a half
    factor = float(np.median(values / (2 * gammaincinv(free / 2, 0.5))))
    for _ in range(100):
        kept = values <= factor * cut
        after = float(values[kept].sum() / expected[kept].sum()) if kept.any() else factor
        if abs(after - factor) <= 1e-9 * factor:
            break
        factor = after
    return factor
