"""Photographs of a board by both cameras of a rig that is known exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.boards import Board
from vision3d.render.patterns import board_planes
from vision3d.render.poses import MARGIN_PX, board_pixels, board_poses
from vision3d.render.scene import render_planes
from vision3d.rigid import compose

if TYPE_CHECKING:
    from vision3d.stereo.rig import StereoRig

__all__ = ["RenderedPairs", "render_board_pairs"]

Picture = NDArray[np.uint8]
TRIES = 60  # poses that the left camera sees, for each that the right one has to see too


@dataclass(frozen=True, slots=True)
class RenderedPairs:
    """Pairs of photographs of a board, and what is true of them.

    Parameters
    ----------
    rig, board : what was photographed by what
    left, right : n images each
    poses : (n, 7) left_T_board
    """

    rig: StereoRig
    board: Board
    left: tuple[Picture, ...]
    right: tuple[Picture, ...]
    poses: NDArray[np.float64]

    def named(self) -> list[tuple[str, Picture, Picture]]:
        """A name, the left and the right image of each pair."""
        return [(f"pair{k + 1:02d}", *pair) for k, pair in enumerate(zip(self.left, self.right, strict=True))]


def render_board_pairs(
    rig: StereoRig, board: Board, n: int, rng: np.random.Generator, **settings: Any
) -> RenderedPairs:
    """Photograph a board n times with both cameras, which both see all of it.

    Parameters
    ----------
    settings : of `render_planes`: blur_px, noise, vignetting …

    Raises
    ------
    ModelError
        where the cameras' fields of view hardly overlap.
    """
    poses: list[NDArray[np.float64]] = []
    for _ in range(TRIES * n):
        if len(poses) == n:
            break
        pose = board_poses(rig.left, board, 1, rng)[0]
        pixels = board_pixels(rig.right, board, compose(rig.right_T_left, pose))
        last = np.array(rig.right.size) - 1 - MARGIN_PX
        if (pixels > MARGIN_PX).all() and (pixels < last).all():
            poses.append(pose)
    if len(poses) < n:
        raise ModelError(f"{len(poses)} of {n} poses found at which both cameras see the whole board")
    sides = [
        tuple(
            render_planes(camera, board_planes(board, pose), rng=own, **settings)
            for pose, own in zip(seen, rng.spawn(n), strict=True)
        )
        for camera, seen in (
            (rig.left, poses),
            (rig.right, [compose(rig.right_T_left, pose) for pose in poses]),
        )
    ]
    chosen = np.array(poses)
    chosen.setflags(write=False)
    for image in (*sides[0], *sides[1]):
        image.setflags(write=False)
    return RenderedPairs(rig, board, sides[0], sides[1], chosen)
