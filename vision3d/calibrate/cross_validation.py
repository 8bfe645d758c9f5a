"""Is the calibration good beyond its own views?  Leave some out, calibrate, and try them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.adjustment import Unknowns, adjust, linearize
from vision3d.calibrate.calibration import Calibration
from vision3d.calibrate.covariance import reduced
from vision3d.calibrate.descent import schur
from vision3d.calibrate.look_alikes import folds_of
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.robust import weights_of

__all__ = ["LeaveOneOut", "held_out_squares", "leave_one_out"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MANY_FOLDS = 60
"""From here on one Newton step stands for the solve without a fold."""


@dataclass(frozen=True, eq=False)
class LeaveOneOut:
    """What each view says about a calibration that has not seen it.

    Attributes
    ----------
    rms_px : float
        Root mean square distance of the corners of views left out, over all of them, their poses fitted.
    view_rms : Array
        The same for every view, (V,).
    train_rms_px : float
        The calibration's own, over the same corners.
    parameters : Array
        (G, p), without each view in turn, or each group of views alike.
    jackknife_std : Array
        (p,), standard deviations of the parameters by the jackknife: they include what the views have in
        common that independent noise does not explain, such as a bent board.
    ratio : Array
        (p,), those over the stated ones: about 1 where the stated ones are honest.
    """

    rms_px: float
    view_rms: Array
    train_rms_px: float
    parameters: Array
    jackknife_std: Array
    ratio: Array


def leave_one_out(calibration: Calibration) -> LeaveOneOut:
    """Leave out each view in turn, together with those that show the board in the same place.

    Corners that the calibration left out stay out, and views that it trusts less count as little here.
    Efron, Tibshirani 1993, "An introduction to the bootstrap", eq. 11.5, for the jackknife.
    """
    problem = Problem.of(calibration.views, calibration.floor_px, calibration.sigma_scale)
    weights = np.concatenate(calibration.weights)
    folds = folds_of(calibration.views)
    squares, parameters = held_out_squares(problem, calibration, weights, folds)
    full = weights == 1.0
    own = np.sum(np.concatenate(calibration.residuals) ** 2, axis=1)
    view_rms = np.sqrt([np.mean(one) for one in problem.split(squares)])
    spread = parameters - parameters.mean(axis=0)
    std = np.sqrt((len(folds) - 1) / len(folds) * np.sum(spread**2, axis=0))
    return LeaveOneOut(
        float(np.sqrt(np.mean(squares[full]))),
        view_rms,
        float(np.sqrt(np.mean(own[full]))),
        parameters,
        std,
        std / calibration.std,
    )


def held_out_squares(
    problem: Problem, calibration: Calibration, relative: Array, folds: Sequence[Sequence[int]]
) -> tuple[Array, Array]:
    """Squared distances (M,) of corners from a calibration without their views, and its parameters.

    Parameters
    ----------
    problem : Problem
        All views.
    calibration : Calibration
        Of all of them: where every solve begins.
    relative : Array
        (M,) weights in units of 1 / sigma².
    folds : Sequence[Sequence[int]]
        Numbers of the views that are left out together; every view in one fold.

    Returns
    -------
    squares, parameters : Array
        (M,) px², and (folds, p).
    """
    weights = weights_of(problem, relative)
    fits = _solved(problem, calibration, weights, folds)
    if len(folds) > MANY_FOLDS:
        fits = _stepped(problem, calibration, weights, folds)
    squares, parameters = np.empty(len(weights)), []
    for fold, (camera, warp) in zip(folds, fits, strict=True):
        out = np.isin(np.arange(problem.count), fold)
        rows = out[problem.owner]
        tried = Unknowns(calibration.camera.lens, camera, warp, calibration.poses[out])
        squares[rows] = _posed(problem.only(np.flatnonzero(out)), tried, weights[rows])
        parameters.append(camera)
    return squares, np.array(parameters)


def _free(calibration: Calibration) -> Mask:
    """What was estimated besides the poses."""
    p = calibration.camera.count
    free = np.ones(p + 2, dtype=bool)
    free[p:] = calibration.warp_std > 0.0
    return free


def _solved(
    problem: Problem, calibration: Calibration, weights: Array, folds: Sequence[Sequence[int]]
) -> Iterator[tuple[Array, Array]]:
    """Parameters and warp without each fold, by an adjustment of the others."""
    lens, free = calibration.camera.lens, _free(calibration)
    for fold in folds:
        kept = ~np.isin(np.arange(problem.count), fold)
        begun = Unknowns(lens, calibration.camera.parameters, calibration.warp, calibration.poses[kept])
        rest = problem.only(np.flatnonzero(kept))
        found = adjust(rest, begun, weights[kept[problem.owner]], free, settled=1e-9).unknowns
        yield found.parameters, found.warp


def _stepped(
    problem: Problem, calibration: Calibration, weights: Array, folds: Sequence[Sequence[int]]
) -> Iterator[tuple[Array, Array]]:
    """The same by one Newton step from the minimum of all: among many views one moves it little.

    Without the fold the information is S - S_f and the score -s_f, so θ moves by -(S - S_f)⁻¹ s_f.
    """
    free, p = _free(calibration), calibration.camera.count
    camera = calibration.camera
    blocks = linearize(
        problem, Unknowns(camera.lens, camera.parameters, calibration.warp, calibration.poses), weights
    )
    S, _, _, Y = schur(blocks, free)
    information, scores = reduced(blocks, free, Y)
    for fold in folds:
        moved = np.concatenate([camera.parameters, calibration.warp])
        rest = S - information[list(fold)].sum(axis=0)
        moved[free] -= np.linalg.solve(rest, scores[list(fold)].sum(axis=0))
        yield moved[:p], moved[p:]


def _posed(problem: Problem, unknowns: Unknowns, weights: Array) -> Array:
    """Squared distances of corners, their poses fitted and the camera held."""
    held = np.zeros(len(unknowns.parameters) + 2, dtype=bool)
    solution = adjust(problem, unknowns, weights, held, settled=1e-9)
    squares: Array = np.sum(solution.blocks.residuals**2, axis=1)
    return squares
