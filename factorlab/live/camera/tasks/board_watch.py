"""Where a board is in a moving picture, whether it rests, and whether its pose is new."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision3d.boards import Board, CharucoBoard, Checkerboard, CircleGrid
from vision3d.frames import Frame

__all__ = ["BoardWatch", "SeenBoard", "quick_corners"]

Array = NDArray[np.float64]
WIDTH_PX = 640  # a wider image is halved until it is no wider: a watch has to be quick
STILL_PX_S = 12.0  # mean speed of the corners of a board that is held still, in an image of that width
STILL_S = 0.25
NEW_SHARE = 0.03  # of the image's width that corners have moved, on the mean, in a pose that is new
SAME_SHARE = 0.002  # photographs that differ by less are the same one, in a folder that plays again
FEWEST = 6


@dataclass(frozen=True)
class SeenBoard:
    """A board in one frame.

    Parameters
    ----------
    ids : (N,) numbers of the corners
    pixels : (N, 2) to a pixel or so
    speed_px_s : mean speed of the corners; infinite in the first frame
    still : it has been held still for a while
    photograph : it is in a picture of its own, which somebody chose to take
    """

    ids: NDArray[np.int64]
    pixels: Array
    speed_px_s: float
    still: bool
    photograph: bool = False


class BoardWatch:
    """Follows one board from frame to frame.

    Parameters
    ----------
    board : a checkerboard, ChArUco board or grid of circles
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self._before: tuple[int, NDArray[np.int64], Array] | None = None
        self._rest_ns: int | None = None  # since when it has been still
        self._last: tuple[Frame, SeenBoard | None] | None = None

    def look(self, frame: Frame) -> SeenBoard | None:
        """The board in this frame, also when it comes a second time; None where it is not seen."""
        if self._last is None or self._last[0] is not frame:
            self._last = (frame, self._look(frame))
        return self._last[1]

    def _look(self, frame: Frame) -> SeenBoard | None:
        ids, pixels = quick_corners(np.asarray(frame.grey), self.board)
        if len(ids) < FEWEST:
            self._before = self._rest_ns = None
            return None
        speed = np.inf
        if self._before is not None and (passed := (frame.t_ns - self._before[0]) * 1e-9) > 0:
            speed = motion(*self._before[1:], ids, pixels) / passed
        self._before = (frame.t_ns, ids, pixels)
        if speed > STILL_PX_S * max(1.0, frame.image.shape[1] / WIDTH_PX):
            self._rest_ns = None
        elif self._rest_ns is None:
            self._rest_ns = frame.t_ns
        rested = self._rest_ns is not None and frame.t_ns - self._rest_ns >= STILL_S * 1e9
        return SeenBoard(ids, pixels, float(speed), rested or frame.still, frame.still)

    def forget(self) -> None:
        """Begin anew: the next frame has nothing before it."""
        self._before = self._rest_ns = self._last = None

    @staticmethod
    def is_new(seen: SeenBoard, kept: list[SeenBoard], width: int) -> bool:
        """Whether the board is elsewhere, or turned otherwise, than in every view that was kept."""
        share = SAME_SHARE if seen.photograph else NEW_SHARE
        return all(motion(one.ids, one.pixels, seen.ids, seen.pixels) > share * width for one in kept)


def motion(ids_a: NDArray[np.int64], a: Array, ids_b: NDArray[np.int64], b: Array) -> float:
    """Mean distance of the corners that both have, px; of a board that was read from its other end, too."""
    _, left, right = np.intersect1d(ids_a, ids_b, assume_unique=True, return_indices=True)
    if not len(left):
        return float("inf")
    one, other = a[left], b[right]
    both_ways = (other, other[::-1]) if len(one) == len(a) == len(b) else (other,)
    return float(min(np.linalg.norm(one - way, axis=1).mean() for way in both_ways))


def quick_corners(grey: NDArray[np.uint8], board: Board) -> tuple[NDArray[np.int64], Array]:
    """Numbers (N,) and pixels (N, 2) of a board's corners, found in milliseconds; none where it is unseen."""
    import cv2

    from vision3d.cv import detect_charuco, find_chessboard, find_circles

    image: Any = grey
    scale = 1
    while image.shape[1] > WIDTH_PX:
        image, scale = cv2.pyrDown(image), 2 * scale
    found, pixels, ids = False, np.empty((0, 2)), np.arange(board.count)
    columns, rows = board.shape
    if isinstance(board, Checkerboard):
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
        found, pixels = find_chessboard(image, columns, rows, flags=flags)
    elif isinstance(board, CircleGrid):
        found, pixels = find_circles(image, columns, rows, asymmetric=board.asymmetric)
    elif isinstance(board, CharucoBoard):
        seen: Any = detect_charuco(image, board.opencv())
        found, pixels, ids = True, seen.corners, seen.ids
    if not found or len(pixels) != len(ids):
        return np.empty(0, np.int64), np.empty((0, 2))
    return np.asarray(ids, np.int64), scale * np.asarray(pixels, np.float64)
