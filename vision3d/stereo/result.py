"""From a solved joint adjustment to a `StereoCalibration`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import UnderConstrainedError
from vision3d.calibrate.calibration import Calibration, SolveReport
from vision3d.calibrate.covariance import Covariances, covariances
from vision3d.calibrate.look_alikes import groups_of
from vision3d.calibrate.robust import Trusted, weights_of
from vision3d.camera import Camera
from vision3d.stereo.calibration import SIDES, StereoCalibration
from vision3d.stereo.consensus import Consensus
from vision3d.stereo.joint_problem import JointProblem, JointUnknowns
from vision3d.stereo.rig import StereoRig
from vision3d.stereo.view_pairs import ViewPair

__all__ = ["freedom_of", "groups_of_pairs", "joint_result"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FREE_FOCAL = 0.25
"""Relative standard deviation of a focal length from which the views are said to leave it free."""
ILL = 1e8
"""Condition number from which single coefficients mean nothing."""


def joint_result(
    problem: JointProblem,
    trusted: Trusted[JointUnknowns],
    free: Mask,
    agreed: Consensus,
    alone: tuple[Calibration | None, Calibration | None],
) -> StereoCalibration:
    """Judge the solution and put everything together.

    Raises
    ------
    UnderConstrainedError
        The views leave a focal length free.
    """
    solution, at = trusted.solution, trusted.solution.unknowns
    residuals, relative = solution.blocks.residuals, trusted.weights
    cost = solution.blocks.cost(weights_of(problem, relative))
    scale = float(np.sqrt(2.0 * cost / max(freedom_of(problem, relative, free), 1)))
    known = covariances(solution.blocks, free, scale, groups_of_pairs(problem.pairs))
    _require_focal(known, at)
    left, right = (
        Camera(lens, values[:4], values[4:], side.size)
        for lens, values, side in zip(
            at.lenses, (at.left, at.right), (problem.left, problem.right), strict=True
        )
    )
    rig = StereoRig(left, right, at.right_T_left, known.joint[:-2, :-2])
    squares, full, is_right = np.sum(residuals**2, axis=1), relative == 1.0, problem.is_right
    pair_rms = np.full((len(problem.pairs), 2), np.nan)
    for (side, pair), own in zip(problem.pictures, problem.split(squares), strict=True):
        pair_rms[pair, side] = np.sqrt(np.mean(own))
    follows = known.pose_follows
    noise = ((problem.left.floor_px, problem.left.scale), (problem.right.floor_px, problem.right.scale))
    outliers = _left_out(problem, relative)
    return StereoCalibration(
        rig=rig,
        joint_cov=known.joint,
        cov_independent=known.independent,
        inflation=known.inflation,
        free=free,
        pairs=problem.pairs,
        poses=at.poses,
        pose_covs=known.pose_alone + np.einsum("vip,pq,vjq->vij", follows, known.joint, follows),
        pose_follows=follows,
        pose_alone=known.pose_alone,
        warp=at.warp,
        pictures=problem.pictures,
        residuals=problem.split(residuals),
        weights=problem.split(relative),
        sigma_px=tuple(  # type: ignore[arg-type]
            scale * _rms(one.sigma_px**2) for one in (problem.left, problem.right)
        ),
        noise=noise,
        sigma_scale=scale,
        rms_px=_rms(squares[full]),
        rms_left_px=_rms(squares[full & ~is_right]),
        rms_right_px=_rms(squares[full & is_right]),
        rms_all_px=_rms(squares),
        pair_rms=pair_rms,
        outliers=outliers,
        outlier_pictures=tuple(problem.pictures[k] for k in trusted.outlier_views),
        disagreeing=agreed.disagreeing,
        renumbered=agreed.renumbered,
        alone=alone,
        report=_report(problem, trusted, known, agreed, rig, free, _rms(squares[full])),
    )


def freedom_of(problem: JointProblem, relative: Array, free: Mask) -> int:
    """Coordinates that count, less what was estimated from them."""
    return 2 * int(np.count_nonzero(relative)) - int(free.sum()) - 6 * len(problem.pairs)


def groups_of_pairs(pairs: Sequence[ViewPair]) -> NDArray[np.int64]:
    """Number of the group of every pair, (V,): pairs that show the board in the same place err alike.

    Pairs are compared by their left views, those that have none among themselves by their right ones.
    """
    groups = np.empty(len(pairs), dtype=np.int64)
    count = 0
    for side in (0, 1):
        views = {v: pair.left if side == 0 else pair.right for v, pair in enumerate(pairs)}
        chosen = [v for v, pair in enumerate(pairs) if (pair.left is None) == bool(side)]
        if chosen:
            own = groups_of([view for v in chosen if (view := views[v]) is not None])
            groups[chosen] = count + own
            count += int(own.max()) + 1
    return groups


def _rms(squares: Array) -> float:
    return float(np.sqrt(np.mean(squares))) if len(squares) else float("nan")


def _require_focal(known: Covariances, at: JointUnknowns) -> None:
    std, p = np.sqrt(np.diag(known.joint)), 6 + len(at.left)
    for side, begin, values in ((SIDES[0], 6, at.left), (SIDES[1], p, at.right)):
        share = float((std[begin : begin + 2] / values[:2]).max())
        if not share < FREE_FOCAL:
            raise UnderConstrainedError(
                f"the views do not determine the focal length of the {side} camera (its standard deviation "
                f"would be {100 * share:.0f} %): add pairs with the board tilted by 30-45° about its "
                "vertical and about its horizontal axis, near enough to fill the image"
            )


def _left_out(problem: JointProblem, relative: Array) -> tuple[tuple[int, int, int], ...]:
    found = []
    for (side, pair), own in zip(problem.pictures, problem.split(relative), strict=True):
        view = problem.pairs[pair].left if side == 0 else problem.pairs[pair].right
        assert view is not None  # noqa: S101 - a picture shows the board
        found += [(side, pair, int(view.ids[i])) for i in np.flatnonzero(own == 0.0)]
    return tuple(found)


def _report(
    problem: JointProblem,
    trusted: Trusted[JointUnknowns],
    known: Covariances,
    agreed: Consensus,
    rig: StereoRig,
    free: Mask,
    rms_px: float,
) -> SolveReport:
    whole = sum(pair.is_whole for pair in problem.pairs)
    used = int(np.count_nonzero(trusted.weights))
    settled = "settled" if trusted.solution.converged else "not settled"
    message = (
        f"{rig.left.lens} and {rig.right.lens}: {whole} pairs, {used} of {len(trusted.weights)} corners, RMS "
        f"{rms_px:.3f} px, {settled} after {trusted.iterations} steps"
    )
    found = [str(one) for one in agreed.disagreeing]
    if not trusted.solution.converged:
        found.append("the solve had not settled when it ended: the result may be away from the best fit")
    found += [
        f"{name}: its right picture counted the corners from another end; that was mended"
        for name in agreed.renumbered
    ]
    if rig.is_swapped:
        above = "above" if rig.is_vertical else "on the left of"
        found.append(f"the camera called right stands {above} the one called left: exchange them")
    for side, camera in zip(SIDES, (rig.left, rig.right), strict=True):
        if (fold := camera.check_monotonic()).inside:
            found.append(f"{side} camera: {fold}")
    remarks = []
    if known.inflation > 1.0:
        remarks.append(
            "the corners of one pair err together (a board that is not quite flat, a lens that is not quite "
            f"the model): standard deviations are {known.inflation:.1f}x those of independent corners"
        )
    if known.condition > ILL:
        remarks.append(
            f"some parameters can trade places with each other (condition {known.condition:.0e}): read the "
            "uncertainty of rows and depths, not of single coefficients"
        )
    weakest = _names(known.weakest, rig)
    return SolveReport(
        message,
        trusted.solution.converged,
        trusted.iterations,
        known.condition,
        weakest if free.any() else "",
        (*found, *remarks),
        tuple(remarks),
    )


def _names(weakest: Array, rig: StereoRig) -> str:
    """Parameters that take part in a direction."""
    share = np.abs(weakest)
    pose = ("rx", "ry", "rz", "px", "py", "pz")
    cameras = [
        f"{side} {name}" for side, one in zip(SIDES, (rig.left, rig.right), strict=True) for name in one.names
    ]
    names = (*pose, *cameras, "warp x", "warp y")
    return ", ".join(name for name, part in zip(names, share, strict=True) if part > 0.5 * share.max())
