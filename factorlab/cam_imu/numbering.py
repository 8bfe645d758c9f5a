"""A board that looks the same upside down, numbered the same way in every frame of a motion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sequential.errors import FactorlabError
from sequential.manifold import SO3
from sequential.manifold.quaternion import quaternion_inverse

if TYPE_CHECKING:
    from vision3d.boards import Board
    from vision3d.camera import Camera
    from vision3d.views import View

__all__ = ["numbered_alike"]


def numbered_alike(camera: Camera, board: Board, views: tuple[View, ...]) -> tuple[View, ...]:
    """Views whose corners are counted from the end that the frame before was counted from.

    A camera does not turn by more than a quarter about the board between two frames, so of the two ways of
    counting the one nearer to the pose before is right.  Other boards pass unchanged.
    """
    from vision3d.pose import estimate_pose

    if board.half_turn is None:
        return views
    found, before = [], None
    for view in views:
        ways = [view, _turned(board, view)]
        attitudes = []
        for one in ways:
            try:
                pose = estimate_pose(camera, one.points, one.pixels, one.sigma_px).camera_T_object
            except FactorlabError:
                break
            attitudes.append(quaternion_inverse(pose[:4]))
        if len(attitudes) < len(ways):
            continue
        nearer = 0
        if before is not None:
            angles = [float(np.linalg.norm(SO3().local(before, one))) for one in attitudes]
            nearer = int(np.argmin(angles))
        before = attitudes[nearer]
        found.append(ways[nearer])
    return tuple(found)


def _turned(board: Board, view: View) -> View:
    """The view counted from the other end."""
    assert board.half_turn is not None  # noqa: S101 - the caller has looked
    ids = board.half_turn[view.ids]
    return replace(view, ids=ids, points=board.points[ids])
