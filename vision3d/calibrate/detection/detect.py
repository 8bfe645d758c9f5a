"""A board in many images: detection, refinement and audit of each, side by side."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import chain, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.boards import Board, CharucoBoard, Checkerboard, CircleGrid, MarkerBoard
from vision3d.calibrate.detection.another import another_kind
from vision3d.calibrate.detection.audit import audited
from vision3d.calibrate.detection.charuco import find_charuco, find_marker_board
from vision3d.calibrate.detection.checkerboards import find_checkerboard
from vision3d.calibrate.detection.circles import find_circle_grid
from vision3d.calibrate.detection.found import Found, NotFound
from vision3d.views import Detections, Missed, View, ViewAudit

__all__ = ["detect_view", "detect_views", "grey_of"]

Image = NDArray[np.generic]
Outcome = tuple[View, ViewAudit, bool] | Missed
Progress = Callable[[int, str], None]
SMALLEST_PX = 16
"""Side of an image below which nothing is looked for: OpenCV's thresholds take windows of an image's size."""


def detect_views(
    images: Iterable[tuple[str, Image]],
    board: Board,
    *,
    window: int | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
) -> Detections:
    """Look for a board in every image.

    Parameters
    ----------
    images : names and images, (h, w) or (h, w, 3) in OpenCV's order of channels, 8 or 16 bits
    board : what to look for
    window : half-width in px of OpenCV's corner refinement, forced on every corner; by default each corner
        has the window that its neighbours allow
    progress : called with the number of images done and the name of the last
    workers : images in work at a time; by default as many as there are processors.  The time goes into
        OpenCV and compiled loops, which run side by side in threads.

    Raises
    ------
    ModelError
        if the window is no positive whole number, or the board has circles.
    ShapeError
        if an image is no image.
    """
    if window is not None and (not isinstance(window, int) or window < 1):
        raise ModelError(f"a window is a whole number of pixels, at least 1, to each side; got {window!r}")
    if window is not None and isinstance(board, CircleGrid):
        raise ModelError("a window is for corners, and circles have none: leave --window out")
    outcomes: list[Outcome] = []
    coming = iter(images)
    first = list(islice(coming, 1))
    for name, outcome in _each(chain(first, coming), board, window, workers or os.cpu_count() or 1):
        outcomes.append(outcome)
        if progress is not None:
            progress(len(outcomes), name)
    missed = tuple(one for one in outcomes if isinstance(one, Missed))
    seen = [one for one in outcomes if not isinstance(one, Missed)]
    findings = _findings(board, seen, missed, window)
    if first and not seen and not findings:
        name, image = first[0]
        another = another_kind(grey_of(image, name), board)
        findings = (f"{name} shows {another}",) if another else ()
    return Detections(
        tuple(view for view, _, _ in seen), missed, tuple(audit for _, audit, _ in seen), findings
    )  # fmt: skip


def detect_view(name: str, image: Image, board: Board, *, window: int | None = None) -> Outcome:
    """Look for a board in one image: its view, its audit and whether the first square is dark, or Missed."""
    grey = grey_of(image, name)
    found = _find(grey, board)
    if isinstance(found, NotFound):
        return Missed(name, found.reason or _reason(board, found.seen), found.seen)
    return *audited(name, grey, board, found, window), found.dark_first


def grey_of(image: Image, name: str = "image") -> NDArray[np.uint8]:
    """One channel of 8 bits of an image (h, w), (h, w, 3) or (h, w, 4); 16 bits are scaled to their range.

    Raises
    ------
    ShapeError
        if the image has another shape or kind of numbers.
    """
    import cv2

    array: NDArray[Any] = np.asarray(image)
    whole = array.ndim == 2 or (array.ndim == 3 and array.shape[2] in {1, 3, 4})
    if not whole or array.size == 0 or array.dtype not in (np.uint8, np.uint16):
        raise ShapeError(
            f"{name}: an image is (h, w), (h, w, 3) or (h, w, 4) of 8 or 16 bits, got {array.dtype} of shape "
            f"{array.shape}"
        )
    if array.dtype == np.uint16:
        array = np.round(array * (255.0 / max(int(array.max()), 1))).astype(np.uint8)
    if array.ndim == 3:
        codes = {3: cv2.COLOR_BGR2GRAY, 4: cv2.COLOR_BGRA2GRAY}
        array = (
            np.asarray(cv2.cvtColor(array, codes[array.shape[2]])) if array.shape[2] > 1 else array[..., 0]
        )
    grey: NDArray[np.uint8] = np.require(array, np.uint8, ["C", "W"])
    return grey


def _find(grey: NDArray[np.uint8], board: Board) -> Found | NotFound:
    if min(grey.shape) < SMALLEST_PX:
        width, height = grey.shape[::-1]
        return NotFound(reason=f"{width}x{height} px are too few to show a {board.name}")
    if isinstance(board, Checkerboard):
        return find_checkerboard(grey, board)
    if isinstance(board, CharucoBoard):
        return find_charuco(grey, board)
    if isinstance(board, MarkerBoard):
        return find_marker_board(grey, board)
    if isinstance(board, CircleGrid):
        return find_circle_grid(grey, board)
    raise ModelError(f"a {board.kind} board cannot be looked for here")


def _each(
    images: Iterable[tuple[str, Image]], board: Board, window: int | None, workers: int
) -> Iterator[tuple[str, Outcome]]:
    """Outcomes in the order of the images; only as many images as needed are in memory."""
    coming = iter(images)
    with ThreadPoolExecutor(workers) as pool:
        waiting: list[tuple[str, Future[Outcome]]] = []
        try:
            while True:
                for name, image in islice(coming, 2 * workers - len(waiting)):
                    waiting.append((name, pool.submit(detect_view, name, image, board, window=window)))
                if not waiting:
                    return
                name, future = waiting.pop(0)
                yield name, future.result()
        finally:
            for _, future in waiting:
                future.cancel()


def _reason(board: Board, seen: tuple[int, int] | None) -> str:
    if seen is None:
        return f"no {board.name} found: the whole board must be in the image, sharp, and lit without glare"
    columns, rows = seen
    if isinstance(board, CircleGrid):
        return (
            f"no {board.name} found; I see {columns}x{rows} circles: either the size of the grid is not "
            "what was given, or a part of it is hidden or cut off"
        )
    wanted = tuple(sorted(board.shape, reverse=True))
    if (columns + 1, rows + 1) == wanted:
        return (
            f"no {board.name} found; I see {columns}x{rows} inner corners, one fewer each way: inner "
            f"corners are counted, not squares; try --board {columns}x{rows}"
        )
    return (
        f"no {board.name} found; I see {columns}x{rows} inner corners: either the size of the board is not "
        "what was given (inner corners are counted, not squares), or a part of it is hidden or cut off"
    )


def _findings(
    board: Board,
    seen: list[tuple[View, ViewAudit, bool]],
    missed: tuple[Missed, ...],
    window: int | None,
) -> tuple[str, ...]:
    said = []
    sizes = Counter(one.seen for one in missed if one.seen is not None)
    if sizes and not seen:
        (columns, rows), times = sizes.most_common(1)[0]
        things = "circles" if isinstance(board, CircleGrid) else "inner corners"
        if times >= max(2, len(missed) // 3) or len(missed) == times:
            said.append(
                f"{times} of {len(missed)} images show {columns}x{rows} {things} where a {board.name} was "
                f"expected: try --board {columns}x{rows}"
            )
    if isinstance(board, Checkerboard) and board.half_turn is not None and seen:
        said.append(
            f"a {board.columns}x{board.rows} board looks the same upside down, so that its corners may be "
            "numbered from either end: harmless for one camera; for several, take one even and one odd side"
        )
    odd = isinstance(board, Checkerboard) and board.columns % 2 == board.rows % 2 == 1
    flipped = [view.name for view, _, dark in seen if not dark]
    if odd and flipped and len(flipped) < len(seen):
        fewer = min(flipped, [view.name for view, _, dark in seen if dark], key=len)
        said.append(f"{_named(fewer)} mirrored against the others: take them out or flip them back")
    large = [audit for _, audit, _ in seen if audit.window_too_large]
    if window is not None and large:
        moved = sum(len(audit.moved) for audit in large)
        farthest = max((px for audit in large for _, px in audit.moved), default=0.0)
        said.append(
            f"the forced window of ±{window} px is too large in {len(large)} of {len(seen)} views"
            + (f": it moves {moved} corners by up to {farthest:.1f} px" if moved else "")
            + "; leave --window out, and each corner gets the window that its neighbours allow"
        )
    return tuple(said)


def _named(names: list[str]) -> str:
    shown = ", ".join(names[:5]) + (", …" if len(names) > 5 else "")
    return f"{shown} {'is' if len(names) == 1 else 'are'}"
