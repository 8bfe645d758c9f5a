"""Where to hold the board next: the pose that takes most of the uncertainty away.

What a view will tell is known before it is taken: the information matrix of its corners depends on where they
are, not on what noise they have.  Many poses are tried, each view's own pose is eliminated, and the one whose
information makes the mean variance of projections over the image fall most is advised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.manifold.quaternion import rotate, rotation_matrix
from vision3d.boards import Board
from vision3d.calibrate.adjustment import Unknowns, linearize
from vision3d.calibrate.calibration import Calibration
from vision3d.calibrate.pose_candidates import pose_candidates
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.uncertainty import pixel_grid, ray_jacobians, turn_freed
from vision3d.camera import Camera

__all__ = ["NextPose", "next_pose", "next_poses"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NextPose:
    """A pose to take next.

    Attributes
    ----------
    camera_T_board : Array
        (7,), where to hold the board.
    gain : float
        Factor by which the mean variance of projections falls, above 1.
    std_before_px, std_after_px : float
        Root mean square uncertainty over the image, before and after such a view.
    outline_px : Array
        (4, 2), the board's outline in the image, to be drawn over a live picture.
    tilt_rad, distance_m : float
        Angle between the board and the image; distance of its middle.
    words : str
        How to hold the board, for a person.
    """

    camera_T_board: Array
    gain: float
    std_before_px: float
    std_after_px: float
    outline_px: Array
    tilt_rad: float
    distance_m: float
    words: str


def next_pose(calibration: Calibration, board: Board, *, freed_rotation: bool = False) -> NextPose:
    """The pose of the board whose view would make the mean projection variance fall most.

    Parameters
    ----------
    calibration : Calibration
        What is known so far.
    board : Board
        What will be held.
    freed_rotation : bool
        Judge projections with the camera's turn freed, as in `projection_uncertainty`.

    Raises
    ------
    DataError
        No pose that was tried shows the board well enough.
    """
    return next_poses(calibration, board, 1, freed_rotation=freed_rotation)[0]


def next_poses(
    calibration: Calibration, board: Board, count: int, *, freed_rotation: bool = False
) -> tuple[NextPose, ...]:
    """The same for several views one after the other, each chosen as if those before it had been taken."""
    camera = calibration.camera
    poses, seen = pose_candidates(camera, board)
    if not len(poses):
        raise DataError(
            f"no pose shows {board.name} well in an image of this camera: is it the board that was used?"
        )
    free = np.diag(calibration.joint_cov) > 0.0
    told = _information(calibration, board, poses, seen)[:, free][:, :, free]
    told = told / (calibration.sigma_scale * calibration.inflation) ** 2
    image = _mean_square(camera, freed_rotation=freed_rotation)
    whole = np.zeros((len(free), len(free)))
    whole[: camera.count, : camera.count] = image
    image = whole[np.ix_(free, free)]
    cov = calibration.joint_cov[np.ix_(free, free)]
    found = []
    for _ in range(count):
        before = float(np.trace(image @ cov))
        # (C⁻¹ + E)⁻¹ = (I + C E)⁻¹ C
        after = np.linalg.solve(np.eye(len(cov)) + cov @ told, cov[None])
        traces = np.einsum("ij,nji->n", image, after)
        best = int(np.argmin(traces))
        found.append(_described(camera, board, poses[best], before, float(traces[best])))
        cov = 0.5 * (after[best] + after[best].T)
    return tuple(found)


def _information(calibration: Calibration, board: Board, poses: Array, seen: NDArray[np.bool_]) -> Array:
    """What a view at each pose tells about θ, its own pose eliminated, (C, q, q)."""
    n = board.count
    points = np.tile(board.points, (len(poses), 1))
    stated = float(np.median(np.concatenate([view.sigma_px for view in calibration.views])))
    sigma = float(np.hypot(stated, calibration.floor_px))
    problem = Problem.of_points(points, sigma, np.arange(len(poses) + 1) * n, calibration.camera.size)
    unknowns = Unknowns(calibration.camera.lens, calibration.camera.parameters, calibration.warp, poses)
    blocks = linearize(problem, unknowns, seen.ravel() / sigma**2)
    scale = 1.0 / np.sqrt(np.einsum("vii->vi", blocks.T))
    scale = scale[:, :, None] * scale[:, None, :]
    eliminated = blocks.W @ (np.linalg.inv(blocks.T * scale) * scale) @ blocks.W.transpose(0, 2, 1)
    information: Array = blocks.U - eliminated
    return information


def _mean_square(camera: Camera, *, freed_rotation: bool) -> Array:
    """The matrix M with trace(M cov) the mean variance of projections over the image, (p, p)."""
    by_turn, jacobian = ray_jacobians(camera, camera.unproject(pixel_grid(camera.size)))
    if freed_rotation:
        jacobian = jacobian - by_turn @ turn_freed(camera)
    jacobian = jacobian[np.isfinite(jacobian[:, 0, 0])]
    mean: Array = np.einsum("nij,nik->jk", jacobian, jacobian) / len(jacobian)
    return mean


def _described(camera: Camera, board: Board, pose: Array, before: float, after: float) -> NextPose:
    centre = rotate(pose[:4], board.points.mean(axis=0)) + pose[4:]
    normal = rotation_matrix(pose[:4])[:, 2]
    tilt = float(np.arccos(np.clip(normal[2], -1.0, 1.0)))
    distance = float(np.linalg.norm(centre))
    outline = camera.project(rotate(pose[:4], board.outline) + pose[4:])
    return NextPose(
        pose,
        before / after,
        float(np.sqrt(before)),
        float(np.sqrt(after)),
        outline,
        tilt,
        distance,
        f"hold the board {_place(camera, centre)}, {distance:.2f} m away, {_tilted(normal, tilt)}",
    )


def _place(camera: Camera, centre: Array) -> str:
    """Where in the image, in words."""
    x, y = (camera.project(centre[None])[0] + 0.5) / np.array(camera.size)
    across = "left" if x < 0.4 else "right" if x > 0.6 else ""
    down = "top" if y < 0.4 else "bottom" if y > 0.6 else ""
    if across and down:
        return f"into the {down} {across} of the image"
    return f"towards the {across or down} of the image" if across or down else "in the middle of the image"


def _tilted(normal: Array, tilt: float) -> str:
    """How tilted, in words: the side that lies farther away."""
    if tilt < np.radians(10.0):
        return "parallel to the image"
    across = "left" if normal[0] > 0.0 else "right"
    down = "top" if normal[1] > 0.0 else "bottom"
    small, large = sorted([abs(normal[0]), abs(normal[1])])
    if small > 0.5 * large:
        side = f"{down} {across} corner"
    else:
        side = f"{across if abs(normal[0]) > abs(normal[1]) else down} side"
    return f"its {side} tilted away by {np.degrees(tilt):.0f}°"
