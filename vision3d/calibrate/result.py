"""From a solved adjustment to a `Calibration`: scales, covariances, names of what did not fit, findings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import UnderConstrainedError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.calibrate.adjustment import Unknowns
from vision3d.calibrate.calibration import Calibration, SolveReport
from vision3d.calibrate.covariance import covariances
from vision3d.calibrate.findings import findings_of, remarks_of
from vision3d.calibrate.look_alikes import groups_of
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.robust import Trusted, weights_of
from vision3d.camera import Camera
from vision3d.views import View

__all__ = ["result_of", "scale_of"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FREE_FOCAL = 0.25
"""Relative standard deviation of a focal length from which the views are said to leave it free."""


def result_of(
    views: tuple[View, ...], problem: Problem, trusted: Trusted[Unknowns], free: Mask
) -> Calibration:
    """Judge the solution and put everything together.

    Raises
    ------
    UnderConstrainedError
        The views leave a parameter free.
    """
    solution, unknowns = trusted.solution, trusted.solution.unknowns
    residuals, relative = solution.blocks.residuals, trusted.weights
    used = relative > 0.0
    scale = scale_of(problem, trusted, free)
    groups = groups_of(views)
    known = covariances(solution.blocks, free, scale, groups)
    p, follows = len(unknowns.parameters), known.pose_follows
    focal = float((np.sqrt(np.diag(known.joint)[:2]) / unknowns.parameters[:2]).max())
    if not focal < FREE_FOCAL:
        raise UnderConstrainedError(_missing(problem, unknowns.poses, focal))
    camera = Camera(unknowns.lens, unknowns.parameters[:4], unknowns.parameters[4:], problem.size)
    pose_covs = known.pose_alone + np.einsum("vip,pq,vjq->vij", follows, known.joint, follows)
    squares = np.sum(residuals**2, axis=1)
    view_rms = np.sqrt([np.mean(one) for one in problem.split(squares)])
    owner = problem.owner
    numbers = np.concatenate([view.ids for view in views])
    left_out = tuple((int(owner[i]), int(numbers[i])) for i in np.flatnonzero(~used))
    rms = float(np.sqrt(np.mean(squares[relative == 1.0])))
    remarks = remarks_of(known, groups)
    findings = (*findings_of(views, problem, camera, trusted, left_out, known), *remarks)
    message = (
        f"{camera.lens}: {len(views)} views, {int(used.sum())} of {len(used)} corners, RMS {rms:.3f} px, "
        f"{'settled' if solution.converged else 'not settled'} after {trusted.iterations} steps"
    )
    report = SolveReport(
        message,
        solution.converged,
        trusted.iterations,
        known.condition,
        _names(known.weakest, camera),
        findings,
        remarks,
    )
    return Calibration(
        camera=camera,
        cov=known.joint[:p, :p].copy(),
        cov_independent=known.independent[:p, :p].copy(),
        poses=unknowns.poses,
        pose_covs=pose_covs,
        pose_follows=follows,
        pose_alone=known.pose_alone,
        joint_cov=known.joint,
        inflation=known.inflation,
        warp=unknowns.warp,
        views=views,
        residuals=problem.split(residuals),
        weights=problem.split(relative),
        floor_px=problem.floor_px,
        sigma_scale=scale,
        sigma_px=scale * float(np.sqrt(np.mean(problem.sigma_px[used] ** 2))),
        rms_px=rms,
        rms_all_px=float(np.sqrt(np.mean(squares))),
        view_rms=view_rms,
        outliers=left_out,
        outlier_views=trusted.outlier_views,
        report=report,
    )


def scale_of(problem: Problem, trusted: Trusted[Unknowns], free: Mask) -> float:
    """Standard deviation of the residuals in units of sigma, judged by the freedom that is left."""
    freedom = 2 * int(np.count_nonzero(trusted.weights)) - int(free.sum()) - 6 * problem.count
    cost = trusted.solution.blocks.cost(weights_of(problem, trusted.weights))
    return float(np.sqrt(2.0 * cost / max(freedom, 1)))


def _missing(problem: Problem, poses: Array, focal: float) -> str:
    """Say which pose is missing when the focal length is free."""
    tilt = np.degrees(np.arccos(np.clip(np.abs(rotation_matrix(poses[:, :4])[:, 2, 2]), 0.0, 1.0)))
    told = f"its standard deviation would be {100 * focal:.0f} %" if np.isfinite(focal) else "it is free"
    advice = "to other sides, near enough to fill the image"
    if tilt.max() < 15.0:
        told += f"; the board is never tilted by more than {tilt.max():.0f}° against the image"
        advice = "about its vertical axis and about its horizontal axis"
    return (
        f"{problem.count} views do not determine the focal length ({told}): add views with the board "
        f"tilted by 30-45° {advice}"
    )


def _names(weakest: Array, camera: Camera) -> str:
    """Parameters that take part in a direction."""
    share = np.abs(weakest)
    names = (*camera.names, "warp x", "warp y")
    return ", ".join(name for name, part in zip(names, share, strict=True) if part > 0.5 * share.max())
