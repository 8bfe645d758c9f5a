"""Is the calibration good beyond its own views?  Leave some out, calibrate, and try them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.adjustment import Unknowns, adjust
from vision3d.calibrate.calibration import Calibration
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.robust import weights_of

__all__ = ["LeaveOneOut", "held_out_squares", "leave_one_out"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


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
        (V, p), without each view in turn.
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
    """Leave out each view in turn.

    Corners that the calibration left out stay out, and views that it trusts less count as little here.
    Efron, Tibshirani 1993, "An introduction to the bootstrap", eq. 11.5, for the jackknife.
    """
    problem = Problem.of(calibration.views)
    weights = np.concatenate(calibration.weights)
    folds = [[v] for v in range(problem.count)]
    squares, parameters = held_out_squares(problem, calibration, weights, folds)
    full = weights == 1.0
    own = np.sum(np.concatenate(calibration.residuals) ** 2, axis=1)
    view_rms = np.sqrt([np.mean(one) for one in problem.split(squares)])
    spread = parameters - parameters.mean(axis=0)
    std = np.sqrt((problem.count - 1) / problem.count * np.sum(spread**2, axis=0))
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
    p = calibration.camera.count
    free = np.ones(p + 2, dtype=bool)
    free[p:] = calibration.warp_std > 0.0
    squares, parameters = np.empty(len(weights)), []
    for fold in folds:
        out = np.isin(np.arange(problem.count), fold)
        owner = problem.owner
        kept = Unknowns(
            calibration.camera.lens, calibration.camera.parameters, calibration.warp, calibration.poses[~out]
        )
        rest = problem.only(np.flatnonzero(~out))
        found = adjust(rest, kept, weights[~out[owner]], free, settled=1e-9).unknowns
        parameters.append(found.parameters)
        tried = Unknowns(found.lens, found.parameters, found.warp, calibration.poses[out])
        squares[out[owner]] = _posed(problem.only(np.flatnonzero(out)), tried, weights[out[owner]])
    return squares, np.array(parameters)


def _posed(problem: Problem, unknowns: Unknowns, weights: Array) -> Array:
    """Squared distances of corners, their poses fitted and the camera held."""
    held = np.zeros(len(unknowns.parameters) + 2, dtype=bool)
    solution = adjust(problem, unknowns, weights, held, settled=1e-9)
    squares: Array = np.sum(solution.blocks.residuals**2, axis=1)
    return squares
