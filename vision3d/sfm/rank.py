"""What the observations of a bundle adjustment leave free, by name."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import UnderConstrainedError
from vision3d.sfm.adjustment import Reduced, cost_of, reduce
from vision3d.sfm.bundle_problem import BundleProblem, BundleState
from vision3d.sfm.gauge import Directions, constraints, directions

__all__ = ["check_points", "check_seen", "decrement_of", "held_factor", "unknown_name"]

Array = NDArray[np.float64]

PIVOT = 1e-13
"""Share of an unknown, at unit diagonal, that the others leave to it: less, and it counts as free."""


def check_seen(problem: BundleProblem) -> None:
    """Raise `UnderConstrainedError` where a point is seen once, or an image sees fewer than three points."""
    seen = np.diff(problem.starts)
    if (seen < 2).any():
        raise UnderConstrainedError(_free_points(np.flatnonzero(seen < 2), seen))
    sees = np.bincount(problem.images, minlength=len(problem.camera_of))
    sees[list(problem.held)] = 3
    if (sees < 3).any():
        image = int(np.argmax(sees < 3))
        raise UnderConstrainedError(
            f"image {image} ({problem.names[image]}) sees {sees[image]} points, and three is the least that "
            "fix its pose; leave it out, or fix it"
        )


def _free_points(free: NDArray[np.int64], seen: NDArray[np.int64]) -> str:
    often = seen[free[0]]
    many = f"{len(free)} points are left free, the first is" if len(free) > 1 else "a point is left free:"
    return (
        f"{many} point {free[0]}, seen by {often} image{'s' if often != 1 else ''}; a point needs two images "
        "that look at it from different places: leave it out, with vision3d.sfm.filtering.filter_observations"
    )


def held_factor(problem: BundleProblem, reduced: Reduced, held: Directions) -> tuple[Array, Array]:
    """Cholesky factor (n, n), lower, of the reduced matrix at unit diagonal, gauge held; and its scale (n,).

    Raises
    ------
    UnderConstrainedError
        where something else is free; it is named.
    """
    from scipy.linalg import LinAlgError, cho_factor

    scale = 1.0 / np.sqrt(np.maximum(reduced.U, 1e-300))
    D = held.views * scale[:, None]
    D = D / np.maximum(np.linalg.norm(D, axis=0), 1e-300)
    A = reduced.S * scale[:, None] * scale + D @ D.T
    if not len(A):
        return A, scale
    try:
        factor = np.asarray(cho_factor(A, lower=True, check_finite=False)[0])
        pivots = np.diag(factor) ** 2
        weakest, regular = int(np.argmin(pivots)), bool(pivots.min() > PIVOT)
    except LinAlgError:
        factor, regular = A, False
        weakest = int(np.argmax(np.abs(np.linalg.eigh(A)[1][:, 0])))
    if not regular:
        raise UnderConstrainedError(
            f"the observations leave {unknown_name(problem, weakest)} free: the other unknowns can undo what "
            "moves it; refine fewer intrinsics, fix a pose, or add observations"
        )
    return factor, scale


def check_points(problem: BundleProblem, reduced: Reduced) -> None:
    """Raise `UnderConstrainedError` where all that see a point see it along one ray."""
    if reduced.free_points:
        free = np.flatnonzero(reduced.T_inverse[:, 0, 0] == 0.0)
        raise UnderConstrainedError(_free_points(free, np.diff(problem.starts)))


def unknown_name(problem: BundleProblem, place: int) -> str:
    """What an unknown of the views is called."""
    image, part = (int(index) for index in np.argwhere(problem.columns == place)[0])
    if part < 6:
        half = "attitude" if part < 3 else "position"
        return f"the {half} of image {image} ({problem.names[image]})"
    camera = int(problem.camera_of[image])
    return f"{problem.free[camera][part - 6]} of camera {camera}"


def decrement_of(
    problem: BundleProblem, state: BundleState, loss: str, loss_px: float
) -> tuple[float, float]:
    """The cost, and what one more Gauss-Newton step promises to take off it, px².

    Raises
    ------
    UnderConstrainedError
        where something is free beyond the gauge; it is named.
    """
    from scipy.linalg import cho_solve

    linear = problem.linearize(state)
    cost, weights = cost_of(linear.residuals, loss, loss_px)
    reduced = reduce(problem, linear, weights)
    check_points(problem, reduced)
    free = directions(problem, state)
    held = constraints(problem, state, "first pose and scale", free)
    factor, scale = held_factor(problem, reduced, held)
    right = scale * reduced.g
    by_views = float(right @ cho_solve((factor, True), right)) if len(right) else 0.0
    by_points = float(np.einsum("ni,nij,nj->", reduced.b, reduced.T_inverse, reduced.b))
    return cost, 0.5 * (by_views + by_points)
