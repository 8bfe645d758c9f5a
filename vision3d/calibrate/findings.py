"""What a careful user should know of a calibration, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import rotation_matrix
from vision3d.calibrate.adjustment import Unknowns
from vision3d.calibrate.covariance import Covariances
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.robust import Trusted
from vision3d.camera import Camera
from vision3d.views import View

__all__ = ["findings_of", "remarks_of"]

WEAK_FOCAL = 0.01
"""Relative standard deviation of a focal length from which it is called hardly determined."""
ILL = 1e8
"""Condition number from which single coefficients mean nothing."""
DISTINCT = 0.8
"""Views that show the board in fewer places than this share of them are remarked upon."""


def findings_of(
    views: tuple[View, ...],
    problem: Problem,
    camera: Camera,
    trusted: Trusted[Unknowns],
    left_out: tuple[tuple[int, int], ...],
    known: Covariances,
) -> tuple[str, ...]:
    """Views and corners that do not fit, and a camera that should not be used as it is."""
    found: list[str] = []
    if not trusted.solution.converged:
        found.append("the solve had not settled when it ended: the result may be away from the best fit")
    found.extend(_worse_views(views, problem, trusted))
    for v in sorted({one for one, _ in left_out}):
        corners = ", ".join(str(corner) for one, corner in left_out if one == v)
        found.append(f"{views[v].name}: left out corner {corners}, further off than noise explains")
    found.extend(
        f"{views[v].name} shows the board from behind: its corners are numbered in mirror image, as when "
        "the picture was flipped"
        for v in _from_behind(trusted.solution.unknowns.poses, views)
    )
    share = float((np.sqrt(np.diag(known.joint)[:2]) / camera.parameters[:2]).max())
    if share > WEAK_FOCAL:
        found.append(
            "the views hardly determine the focal length (standard deviation "
            f"{100.0 * share:.1f} %): add tilted ones"
        )
    if (fold := camera.check_monotonic()).inside:
        found.append(str(fold))
    return tuple(found)


def remarks_of(known: Covariances, groups: NDArray[np.int64]) -> tuple[str, ...]:
    """What the covariance has to be read with."""
    found: list[str] = []
    distinct = int(groups.max()) + 1
    if distinct < DISTINCT * len(groups):
        found.append(
            f"{len(groups)} views show the board in only {distinct} places: those alike count as one where "
            "views are compared; move the board more between views"
        )
    if known.inflation > 1.0:
        found.append(
            "the corners of one view err together (a board that is not quite flat, a lens that is not quite "
            f"the model): standard deviations are {known.inflation:.1f}x those of independent corners"
        )
    if known.condition > ILL:
        found.append(
            f"some parameters can trade places with each other (condition {known.condition:.0e}): read the "
            "uncertainty of projections, not of single coefficients, or take a lens with fewer coefficients"
        )
    return tuple(found)


def _worse_views(views: tuple[View, ...], problem: Problem, trusted: Trusted[Unknowns]) -> Iterator[str]:
    """Views that were weighted down as a whole."""
    squares = np.sum(trusted.solution.blocks.residuals**2, axis=1)
    for v in trusted.outlier_views:
        rows = slice(problem.starts[v], problem.starts[v + 1])
        times, rms = trusted.weights[rows].max() ** -0.5, np.sqrt(np.mean(squares[rows]))
        yield (
            f"{views[v].name} fits {times:.1f}x worse than the others for what its corners state (RMS "
            f"{rms:.2f} px) and counts accordingly less; look at its corners, or leave it out"
        )


def _from_behind(poses: NDArray[np.float64], views: tuple[View, ...]) -> list[int]:
    """Views of a flat board whose z axis points towards the camera."""
    away = np.einsum("vi,vi->v", rotation_matrix(poses[:, :4])[:, :, 2], poses[:, 4:]) > 0.0
    return [v for v, view in enumerate(views) if not away[v] and not np.ptp(view.points[:, 2]) > 0.0]
