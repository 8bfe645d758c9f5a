"""Calibrate a camera from views of a board: from corners to a `Calibration`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError
from sequential.manifold.quaternion import quaternion_from_matrix
from vision3d.calibrate.adjustment import PRIOR_STD, Unknowns, adjust
from vision3d.calibrate.calibration import Calibration
from vision3d.calibrate.descent import Solution
from vision3d.calibrate.flatness import with_flatness
from vision3d.calibrate.noise import floor_of
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.result import result_of, scale_of
from vision3d.calibrate.robust import Trusted, fit_robustly, weights_of, weights_of_views
from vision3d.calibrate.start import begin, linear_pose
from vision3d.camera import LENSES, Camera
from vision3d.views import View

__all__ = ["calibrate"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FEWEST_VIEWS = 3
"""Two views of a plane determine a pinhole; with a third the fit begins to check itself."""
RADIAL = ("k1", "k2")


def calibrate(
    views: Sequence[View],
    lens: str = "brown5",
    *,
    robust: bool = True,
    board_warp: bool = False,
    start: Calibration | None = None,
) -> Calibration:
    """Estimate a camera, the poses of the board, and how sure both are.

    Parameters
    ----------
    views : Sequence[View]
        At least three views of one board, from different sides; at least 4 corners each.
    lens : str
        A name of `vision3d.camera.LENSES`.
    robust : bool
        Leave out corners that Gaussian noise does not explain, and weight down views that fit much worse
        than the others.  Both are named in the result.
    board_warp : bool
        Estimate as well how far the board is bent along x and along y.
    start : Calibration, optional
        Begin from this camera (any lens) and its poses instead of from nothing; views that it does not name
        are posed by its camera.

    Returns
    -------
    Calibration
        See there.

    Raises
    ------
    DataError
        Too few views or corners, or images of different sizes.
    UnderConstrainedError
        The views leave a parameter free, such as the focal length when all are parallel to the image; the
        message says which pose is missing.
    ModelError
        An unknown lens.

    Notes
    -----
    Maximum likelihood under independent corner errors with the standard deviations of `View.sigma_px`, a
    floor below them and their common scale estimated.  The covariance is the inverse of the information
    (Triggs et al. 2000), widened where the views scatter more: see `vision3d.calibrate.covariance`.
    """
    views = tuple(views)
    _check(views, lens)
    problem = Problem.of(views)
    begun = _grow(problem, views, lens, start, robust=robust)
    free = np.ones(len(begun.unknowns.parameters) + 2, dtype=bool)
    free[-2:] = board_warp
    trusted = _trusted(problem, begun, free, robust=robust)
    floor_px = floor_of(trusted.solution.blocks.residuals, problem.sigma_px)
    if floor_px > 0.0 or lens in PRIOR_STD:
        problem = Problem.of(views, floor_px, scale_of(problem, trusted, free))
        trusted = _trusted(problem, trusted.solution, free, robust=robust)
    found = result_of(views, problem, trusted, free)
    return found if board_warp else with_flatness(found)


def _trusted(problem: Problem, begun: Solution[Unknowns], free: Mask, *, robust: bool) -> Trusted[Unknowns]:
    def solve(at: Unknowns, weights: Array, iterations: int) -> Solution[Unknowns]:
        return adjust(problem, at, weights, free, iterations=iterations)

    return fit_robustly(problem, begun, solve, robust=robust)


def _check(views: tuple[View, ...], lens: str) -> None:
    if lens not in LENSES:
        raise ModelError(f"no lens {lens!r}; known are {', '.join(LENSES)}")
    if len(views) < FEWEST_VIEWS:
        raise DataError(
            f"a calibration takes at least {FEWEST_VIEWS} views of the board, got {len(views)}; take 10 "
            "to 20, some tilted by 30-45° to every side, the corners of the image covered"
        )
    for view in views:
        if view.size != views[0].size:
            raise DataError(
                f"images of one camera have one size, but {views[0].name} is {_size(views[0])} and "
                f"{view.name} is {_size(view)}; calibrate them apart"
            )
        if len(view) < 4:
            raise DataError(f"{view.name} shows {len(view)} corners; a pose takes 4: leave the view out")
    unknown = 4 + len(LENSES[lens].distortion) + 6 * len(views)
    known = 2 * sum(len(view) for view in views)
    if known <= unknown:
        raise DataError(
            f"{known} coordinates cannot determine {unknown} unknowns of {len(views)} views with the lens "
            f"{lens!r}; take more views, or a board with more corners"
        )


def _size(view: View) -> str:
    return f"{view.size[0]}×{view.size[1]}"


def _grow(
    problem: Problem, views: tuple[View, ...], lens: str, start: Calibration | None, *, robust: bool
) -> Solution[Unknowns]:
    """Free the parameters in three stages, so that a strong distortion does not lead astray."""
    count = 4 + len(LENSES[lens].distortion)
    weights = weights_of(problem, np.ones(len(problem.points)))
    if start is not None:
        parameters = np.zeros(count)
        carried = _carried(start.camera, lens)
        parameters[: len(carried)] = carried
        begun = Unknowns(lens, parameters, start.warp, _known_poses(views, start))
        return _staged(problem, weights, begun, stages=1)
    found = begin(problem)
    if robust:
        weights = weights_of(problem, weights_of_views(problem, found.residuals))
    tried = [_staged(problem, weights, _first(problem, lens, found.focal, found.poses))]
    if tried[0].cost > _acceptable(problem, weights):
        other = begin(problem, equidistant=not found.equidistant)
        tried.append(_staged(problem, weights, _first(problem, lens, other.focal, other.poses)))
    return min(tried, key=lambda one: one.cost)


def _known_poses(views: tuple[View, ...], start: Calibration) -> Array:
    """Poses to begin with: those of the views that the start has by name, the others by its camera."""
    named = {view.name: pose for view, pose in zip(start.views, start.poses, strict=True)}
    poses = []
    for view in views:
        if view.name in named and len(named) == len(start.views):
            poses.append(named[view.name])
            continue
        rays = start.camera.unproject(view.pixels)
        seen = np.isfinite(rays[:, 0])
        R, t = linear_pose(view.points[seen], rays[seen])
        poses.append(np.concatenate([quaternion_from_matrix(R), t]))
    return np.array(poses)


def _first(problem: Problem, lens: str, focal: float, poses: Array) -> Unknowns:
    middle = 0.5 * (np.array(problem.size) - 1.0)
    distortion = np.zeros(len(LENSES[lens].distortion))
    return Unknowns(lens, np.concatenate([[focal, focal], middle, distortion]), np.zeros(2), poses)


def _acceptable(problem: Problem, weights: Array) -> float:
    """The cost of corners that are 1 px off: above it another beginning is tried too."""
    return 0.5 * float(np.sum(2.0 * weights))


def _staged(problem: Problem, weights: Array, unknowns: Unknowns, stages: int = 3) -> Solution[Unknowns]:
    names = LENSES[unknowns.lens].parameters
    focal = np.array([name in {"fx", "fy", "k1"} for name in names] + [False, False])
    radial = np.array([name in {"fx", "fy", "cx", "cy", *RADIAL} for name in names] + [False, False])
    every = np.array([True] * len(names) + [False, False])
    solved = [adjust(problem, unknowns, weights, focal if stages > 1 else every, iterations=25, settled=1e-6)]
    for free in (radial, every)[: stages - 1]:
        solved.append(adjust(problem, solved[-1].unknowns, weights, free, iterations=25, settled=1e-6))
    return replace(solved[-1], iterations=sum(one.iterations for one in solved))


def _carried(camera: Camera, lens: str) -> Array:
    """The parameters that another lens has in common with this one: OpenCV's order nests."""
    if LENSES[camera.lens].is_fisheye != LENSES[lens].is_fisheye:
        return camera.parameters[:4]
    return camera.parameters[: 4 + len(LENSES[lens].distortion)]
