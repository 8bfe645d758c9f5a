"""Calibrate two cameras together: from pairs of views to a `StereoCalibration`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError
from vision3d.calibrate import Calibration
from vision3d.calibrate.descent import Solution
from vision3d.calibrate.noise import floor_of
from vision3d.calibrate.robust import Trusted, fit_robustly, weights_of
from vision3d.camera import LENSES, Camera
from vision3d.stereo.alone import Alone, alone
from vision3d.stereo.calibration import StereoCalibration
from vision3d.stereo.consensus import Consensus, consensus_of
from vision3d.stereo.joint_problem import JointProblem, JointUnknowns, Noise, adjust_jointly
from vision3d.stereo.result import freedom_of, joint_result
from vision3d.stereo.view_pairs import ViewPair

__all__ = ["calibrate_stereo"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Sides = tuple[Alone, Alone]

FEWEST_PAIRS = 3
"""Pairs that cameras take which are calibrated with the rig; one does where both are known."""
NOISE_ROUNDS = 2
"""Times that the noise of each camera is judged: the first fit still gives both the same weight."""


def calibrate_stereo(
    pairs: Sequence[ViewPair],
    lenses: str | tuple[str, str] = "brown5",
    *,
    cameras: tuple[Camera | None, Camera | None] = (None, None),
    start: tuple[Calibration | None, Calibration | None] = (None, None),
    robust: bool = True,
    board_warp: bool = False,
) -> StereoCalibration:
    """Estimate both cameras, their pose, the poses of the board, and how sure all of it is.

    Parameters
    ----------
    pairs : of views of one board; those that only one camera saw help to calibrate that camera
    lenses : a name of `vision3d.camera.LENSES`, or one for each camera
    cameras : cameras that are known and held; None is calibrated
    start : calibrations of the left and of the right camera alone, to begin with
    robust : leave out corners that noise does not explain, weight pictures down that fit much worse than the
        others, and take a pair that the others contradict for two separate pictures
    board_warp : estimate as well how far the board is bent

    Raises
    ------
    DataError
        where pairs are too few, of different sizes, or do not belong together.
    UnderConstrainedError
        where the views leave a focal length free.
    ModelError
        for an unknown lens.

    Notes
    -----
    Maximum likelihood under independent corner errors: every corner has its own standard deviation, and
    every camera a floor below them and a scale of its own, which the residuals decide.  Uncertainty is as in
    `vision3d.calibrate.covariance`, the pairs being what is independent.
    """
    pairs = tuple(pairs)
    names = (lenses, lenses) if isinstance(lenses, str) else (lenses[0], lenses[1])
    _check(pairs, names, cameras)
    views = ([pair.left for pair in pairs], [pair.right for pair in pairs])
    left, right = (
        alone(views[k], names[k], cameras[k], start[k], robust=robust, board_warp=board_warp) for k in (0, 1)
    )
    agreed = consensus_of(left, right, pairs)
    begun = _beginning(agreed, (left, right))
    free = np.ones(begun.count, dtype=bool)
    free[6 : 6 + left.camera.count] = left.calibration is not None
    free[6 + left.camera.count : -2] = right.calibration is not None
    free[-2:] = board_warp
    problem = JointProblem.of(agreed.pairs)
    # the pose alone first: the cameras are known well enough not to be led astray by a rough one
    weights = weights_of(problem, np.ones(len(problem.sigma_px)))
    pose_only = np.arange(begun.count) < 6
    trusted = _trusted(
        problem, adjust_jointly(problem, begun, weights, pose_only, iterations=25), free, robust=robust
    )
    for _ in range(NOISE_ROUNDS):
        problem = JointProblem.of(agreed.pairs, _noise(problem, trusted, free))
        trusted = _trusted(problem, trusted.solution, free, robust=robust)
    return joint_result(problem, trusted, free, agreed, (left.calibration, right.calibration))


def _check(
    pairs: tuple[ViewPair, ...], lenses: tuple[str, str], cameras: tuple[Camera | None, Camera | None]
) -> None:
    for lens in lenses:
        if lens not in LENSES:
            raise ModelError(f"no lens {lens!r}; known are {', '.join(LENSES)}")
    whole = sum(pair.is_whole for pair in pairs)
    fewest = 1 if all(camera is not None for camera in cameras) else FEWEST_PAIRS
    if whole < fewest:
        raise DataError(
            f"a stereo calibration takes at least {fewest} pairs whose images both show the board, got "
            f"{whole} of {len(pairs)}; take 10 to 20, the board where both cameras see it, tilted by 30-45° "
            "to every side"
        )


def _beginning(agreed: Consensus, sides: Sides) -> JointUnknowns:
    left, right = sides
    known = [one.calibration.warp for one in sides if one.calibration is not None]
    return JointUnknowns(
        (left.camera.lens, right.camera.lens),
        agreed.right_T_left,
        left.camera.parameters.copy(),
        right.camera.parameters.copy(),
        np.mean(known, axis=0) if known else np.zeros(2),
        agreed.poses,
    )


def _trusted(
    problem: JointProblem, begun: Solution[JointUnknowns], free: Mask, *, robust: bool
) -> Trusted[JointUnknowns]:
    def solve(at: JointUnknowns, weights: Array, iterations: int) -> Solution[JointUnknowns]:
        return adjust_jointly(problem, at, weights, free, iterations=iterations)

    return fit_robustly(problem, begun, solve, robust=robust)


def _noise(problem: JointProblem, trusted: Trusted[JointUnknowns], free: Mask) -> Noise:
    """Floor and scale of the corners of each camera, as the residuals show them."""
    residuals, weights = trusted.solution.blocks.residuals, trusted.weights
    share = freedom_of(problem, weights, free) / max(2 * int(np.count_nonzero(weights)), 1)
    found = []
    for side, chosen in enumerate((~problem.is_right, problem.is_right)):
        r, w, stated = residuals[chosen], weights[chosen], problem.stated(side)
        floor_px = floor_of(r, stated)
        kept = w > 0.0
        whitened = float(np.sum((w * np.sum(r**2, axis=1) / (stated**2 + floor_px**2))[kept]))
        found.append((floor_px, float(np.sqrt(whitened / max(2.0 * share * kept.sum(), 1.0)))))
    return found[0], found[1]
