"""Boards of markers, ChArUco boards and checkerboards: one pose from everything of them that is seen.

>>> pose = marker_board_pose(camera, board, detect_markers(image, board.dictionary))  # doctest: +SKIP
>>> pose.camera_T_board, pose.used, pose.left_out  # doctest: +SKIP

A flat board far away has two readings as one marker has, so the pose is a `MarkerPose` with odds; markers at
known places around a room have one.  A marker that does not fit the others (moved, or misread) is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.boards import Board, MarkerBoard
from vision3d.markers.detection import Marker
from vision3d.markers.flat_object import flat_modes
from vision3d.markers.pose import MarkerPose, Mode, pose_of_modes
from vision3d.views import View

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["BoardPose", "board_pose", "find_board_pose", "marker_board_pose", "points_pose"]

Array = NDArray[np.float64]
FLAT = 1e-6  # of the size of a board: how far its points may be from a plane
MISFIT = 4.5  # sigmas beyond which a marker does not fit the others
MOST_LEFT_OUT = 0.34


@dataclass(frozen=True, eq=False)
class BoardPose:
    """Where a board is.

    Parameters
    ----------
    pose : with one or two readings, as of a marker; `camera_T_marker` there is `camera_T_board` here
    used : numbers of the markers, or of the corners, that the pose is from
    left_out : numbers of those that do not fit the others
    """

    pose: MarkerPose
    used: tuple[int, ...]
    left_out: tuple[int, ...] = ()

    @property
    def camera_T_board(self) -> Array:  # noqa: N802 - frames are written so
        """The likelier pose (7,)."""
        return self.pose.camera_T_marker

    @property
    def cov(self) -> Array:
        """Its covariance (6, 6)."""
        return self.pose.cov


def marker_board_pose(camera: Camera, board: MarkerBoard, markers: Sequence[Marker]) -> BoardPose:
    """Pose of a board from those of its markers that were found.

    Raises
    ------
    DataError
        where none of the markers is one of the board's.
    """
    place = {int(number): k for k, number in enumerate(board.ids)}
    own = [one for one in markers if one.id in place]
    if not own:
        seen = ", ".join(str(one.id) for one in markers) or "none"
        raise DataError(
            f"no marker of the {board.name} is in the picture; its ids are {sorted(place)}, seen: {seen}"
        )
    left_out: list[int] = []
    while True:
        points = np.array([board.corners[place[one.id]] for one in own]).reshape(-1, 3)
        pixels = np.array([one.corners for one in own]).reshape(-1, 2)
        whitening = np.linalg.inv(np.linalg.cholesky(np.array([one.cov for one in own])))
        pose = points_pose(camera, points, pixels, whitening)
        worst, sigmas = _worst(camera, pose, points, pixels, whitening)
        if sigmas < MISFIT or len(own) < 3 or len(left_out) + 1 > MOST_LEFT_OUT * (len(own) + len(left_out)):
            return BoardPose(pose, tuple(one.id for one in own), tuple(sorted(left_out)))
        left_out.append(own.pop(worst).id)


def board_pose(camera: Camera, view: View) -> BoardPose:
    """Pose of a checkerboard, ChArUco board or circle grid from what `detect_views` found of it."""
    if len(view) < 4:
        raise DataError(f"{view.name}: a pose takes four points of the board or more, {len(view)} were found")
    whitening = np.eye(2) / view.sigma_px[:, None, None]
    pose = points_pose(camera, view.points, view.pixels, whitening)
    return BoardPose(pose, tuple(int(k) for k in view.ids))


def find_board_pose(camera: Camera, board: Board, image: NDArray[np.uint8]) -> BoardPose:
    """Find any board in a picture, and its pose.

    Raises
    ------
    DataError
        where it is not there; the message says what is missing.
    """
    if isinstance(board, MarkerBoard):
        from vision3d.markers.detection import detect_markers

        return marker_board_pose(camera, board, detect_markers(image, board.dictionary, camera=camera))
    from vision3d.calibrate.detection import detect_views

    found = detect_views([("picture", image)], board)
    if not found.views:
        raise DataError(f"no {board.name} in the picture: {found.missed[0].reason}")
    return board_pose(camera, found.views[0])


def points_pose(camera: Camera, points: Array, pixels: Array, whitening: Array) -> MarkerPose:
    """Pose of known points (N, 3) seen at pixels (N, 2), both readings where they lie in a plane.

    `whitening` is (B, 2 N / B, 2 N / B): lower triangular matrices that make blocks of residuals white.
    """
    span = np.ptp(points, axis=0).max()
    if np.ptp(points[:, 2]) < FLAT * span:
        return pose_of_modes(flat_modes(camera, points, pixels, np.ascontiguousarray(whitening)))
    from vision3d.pose import estimate_poses

    b = whitening.shape[1] // 2
    variances = np.linalg.inv(whitening.transpose(0, 2, 1) @ whitening)
    sigmas = np.sqrt(np.diagonal(variances, axis1=1, axis2=2).reshape(-1, b, 2).mean(axis=2)).reshape(-1)
    found = estimate_poses(camera, points, pixels, sigmas)[:2]
    scale = max(1.0, found[0].chi2 / max(1, found[0].dof))
    log_z = np.array([0.5 * (np.linalg.slogdet(one.cov)[1] - one.chi2 / scale) for one in found])
    weights = np.exp(log_z - np.logaddexp.reduce(log_z))
    modes = [
        Mode(one.camera_T_object, one.cov * scale, float(weight), one.rms_px, one.camera_T_object)
        for one, weight in zip(found, weights, strict=True)
    ]
    return MarkerPose(tuple(sorted(modes, key=lambda mode: -mode.probability)), scale)


def _worst(
    camera: Camera, pose: MarkerPose, points: Array, pixels: Array, whitening: Array
) -> tuple[int, float]:
    """The block whose residuals are largest, and by how many of what the others have."""
    from vision3d.pose import project_object

    residual = pixels - project_object(camera, pose.modes[0].minimum, points)
    white = np.einsum("bij,bj->bi", whitening, residual.reshape(len(whitening), -1))
    sizes = np.sqrt(np.mean(white**2, axis=1))
    worst = int(np.argmax(sizes))
    others = float(np.median(np.delete(sizes, worst))) if len(sizes) > 1 else 1.0
    return worst, float(sizes[worst] / max(others, 1.0))
