"""Is the rig good beyond its own pairs?  Leave some out, calibrate with the others, and try them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.robust import weights_of
from vision3d.camera import Camera
from vision3d.stereo.calibration import StereoCalibration
from vision3d.stereo.joint_problem import JointProblem, JointUnknowns, adjust_jointly
from vision3d.stereo.rectification import rectify
from vision3d.stereo.result import groups_of_pairs
from vision3d.stereo.rig import StereoRig
from vision3d.stereo.row_errors import row_errors_of

__all__ = ["HeldOut", "leave_pairs_out", "problem_of"]

Array = NDArray[np.float64]
MOST_FOLDS = 25
"""With more groups of pairs than this, several are left out at a time."""
FEWEST_GROUPS = 4


@dataclass(frozen=True, eq=False)
class HeldOut:
    """What each pair says about a calibration that has not seen it.

    Attributes
    ----------
    row_px : float
        Root mean square difference of rows of the corners of pairs left out.
    pair_row_px : Array
        (V,), of every pair; NaN where one camera did not see the board.
    rms_px : float
        Root mean square distance of corners from their projections, the poses of boards fitted.
    pair_rms : Array
        (V, 2), of the left and of the right picture of every pair.
    train_row_px, train_rms_px : float
        The same of the calibration that has seen them.
    rigs : tuple[StereoRig, ...]
        Without each fold in turn.
    jackknife_std : Array
        (6,), standard deviations of `right_T_left` by the jackknife.
    """

    row_px: float
    pair_row_px: Array
    rms_px: float
    pair_rms: Array
    train_row_px: float
    train_rms_px: float
    rigs: tuple[StereoRig, ...]
    jackknife_std: Array


def problem_of(calibration: StereoCalibration) -> tuple[JointProblem, Array, JointUnknowns]:
    """The problem that a calibration solved, its weights in 1/px², and where it ended."""
    problem = JointProblem.of(calibration.pairs, calibration.noise)
    rig = calibration.rig
    at = JointUnknowns(
        (rig.left.lens, rig.right.lens),
        rig.right_T_left,
        rig.left.parameters,
        rig.right.parameters,
        calibration.warp,
        calibration.poses,
    )
    return problem, weights_of(problem, np.concatenate(calibration.weights)), at


def leave_pairs_out(calibration: StereoCalibration) -> HeldOut | None:
    """Leave out each pair in turn, together with those that show the board in the same place.

    Corners that the calibration left out stay out.  None where there are too few pairs to leave one out.
    """
    problem, weights, at = problem_of(calibration)
    groups = groups_of_pairs(calibration.pairs)
    if int(groups.max()) + 1 < FEWEST_GROUPS:
        groups = np.arange(len(calibration.pairs))
    if int(groups.max()) + 1 < FEWEST_GROUPS:
        return None
    parts = np.array_split(np.arange(groups.max() + 1), min(int(groups.max()) + 1, MOST_FOLDS))
    squares = np.full(len(weights), np.nan)
    rows = [np.zeros(0)] * len(calibration.pairs)
    rigs = []
    for part in parts:
        out = np.isin(groups, part)
        found = _without(calibration, problem, weights, at, out)
        rigs.append(_rig(calibration, found))
        held = np.flatnonzero(out)
        chosen = out[problem.pair_of]
        poses = JointUnknowns(
            found.lenses, found.right_T_left, found.left, found.right, found.warp, at.poses[out]
        )
        none = np.zeros(at.count, dtype=bool)
        posed = adjust_jointly(problem.only(held), poses, weights[chosen], none, settled=1e-9)
        squares[chosen] = np.sum(posed.blocks.residuals**2, axis=1)
        pair = rectify(rigs[-1], size=calibration.rig.left.size)
        for v in held:
            if calibration.pairs[v].is_whole:
                rows[v] = row_errors_of(pair, calibration.pairs[v], calibration.weights_of_pair(int(v)))
    return _judged(calibration, problem, squares, rows, tuple(rigs))


def _judged(
    calibration: StereoCalibration,
    problem: JointProblem,
    squares: Array,
    rows: list[Array],
    rigs: tuple[StereoRig, ...],
) -> HeldOut:
    from sequential.manifold import SE3

    full = np.concatenate(calibration.weights) == 1.0
    pair_rms = np.full((len(rows), 2), np.nan)
    for (side, v), own in zip(problem.pictures, problem.split(squares), strict=True):
        pair_rms[v, side] = np.sqrt(np.mean(own))
    rectified = rectify(calibration.rig, size=calibration.rig.left.size)
    train = [
        row_errors_of(rectified, calibration.pairs[v], calibration.weights_of_pair(v))
        for v in calibration.whole
    ]
    poses = np.array([rig.right_T_left for rig in rigs])
    steps = SE3().local(np.broadcast_to(calibration.rig.right_T_left, poses.shape), poses)
    spread = steps - steps.mean(axis=0)
    return HeldOut(
        _rms(np.concatenate(rows)),
        np.array([_rms(one) for one in rows]),
        float(np.sqrt(np.mean(squares[full]))),
        pair_rms,
        _rms(np.concatenate(train)),
        calibration.rms_px,
        rigs,
        np.sqrt((len(rigs) - 1) / len(rigs) * np.sum(spread**2, axis=0)),
    )


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def _without(
    calibration: StereoCalibration,
    problem: JointProblem,
    weights: Array,
    at: JointUnknowns,
    out: NDArray[np.bool_],
) -> JointUnknowns:
    kept = np.flatnonzero(~out)
    begun = JointUnknowns(at.lenses, at.right_T_left, at.left, at.right, at.warp, at.poses[kept])
    rest = problem.only(kept)
    return adjust_jointly(
        rest, begun, weights[~out[problem.pair_of]], calibration.free, settled=1e-9
    ).unknowns


def _rig(calibration: StereoCalibration, at: JointUnknowns) -> StereoRig:
    left, right = (
        Camera(one.lens, values[:4], values[4:], one.size)
        for one, values in ((calibration.rig.left, at.left), (calibration.rig.right, at.right))
    )
    return StereoRig(left, right, at.right_T_left)
