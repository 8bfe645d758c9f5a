"""ChArUco boards and boards of markers in one image: their markers say where to look, and which way round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vision3d.boards import CharucoBoard, MarkerBoard
from vision3d.calibrate.detection.found import Found, NotFound
from vision3d.calibrate.detection.lattice import Array, Ids
from vision3d.calibrate.detection.refine import Refined, refine_saddles

__all__ = ["find_charuco", "find_marker_board"]

Grey = NDArray[np.uint8]

ASTRAY = 0.3
"""Median error of the markers' corners, in sides of a marker, beyond which they are laid out otherwise."""
BESIDE = 2
"""Markers that touch a corner and must have been read, of the two there are."""
MIRROR_MARKERS = 2
INSET = 0.7
"""Share of the margin around a marker that is looked at."""


def find_charuco(grey: Grey, board: CharucoBoard) -> Found | NotFound:
    """Find the inner corners of a ChArUco board beside markers that were read; refined, in order.

    Both of OpenCV's patterns are tried: where the markers lie as those of the other one, the points are
    numbered by it, and a note says so.
    """
    from vision3d.cv import detect_markers

    found = detect_markers(grey, board.dictionary)
    quads, numbers = _known(found.corners, found.ids, len(board.marker_squares))
    if not len(numbers):
        return NotFound(reason=_without_markers(grey, board.dictionary, board.name))
    other = replace(board, legacy=not board.legacy)
    errors = [_astray(one.marker_corners[numbers], quads) for one in (board, other)]
    notes: tuple[str, ...] = ()
    if errors[1] < 0.5 * errors[0] and errors[0] > 0.05:
        board, errors = other, errors[::-1]
        word = "legacy pattern (OpenCV before 4.6)" if other.legacy else "pattern of OpenCV 4.6 and later"
        notes = (f"the board has the {word}, and was read as such",)
    if errors[0] > ASTRAY:
        if said := _mirrored(grey, board.dictionary, len(numbers)):
            return NotFound(reason=said)
        return NotFound(reason=_laid_out_otherwise(board, numbers, quads))
    ids, starts = _predicted(board, numbers, quads)
    if not len(ids):
        return NotFound(
            reason=f"{len(numbers)} markers of the {board.name} were read, but no two that share a corner: "
            "show more of the board"
        )
    refined = refine_saddles(grey, starts, ids, board.shape, _inset(board))
    good = np.isfinite(refined.sigma_px)
    if not good.any():
        return NotFound(reason="markers were read, but no corner between them could be refined: is it sharp?")
    lost = tuple(int(i) for i in ids[~good])
    return Found(ids[good], refined.rows(good), "markers", lost, notes=notes)


def find_marker_board(grey: Grey, board: MarkerBoard) -> Found | NotFound:
    """Find the corners of the markers of a board: point 4 i + k is corner k of its i-th marker."""
    from vision3d.markers import detect_markers

    markers = {one.id: one for one in detect_markers(grey, board.dictionary)}
    seen = [(i, markers[number]) for i, number in enumerate(board.ids.tolist()) if number in markers]
    if not seen:
        return NotFound(reason=_without_markers(grey, board.dictionary, board.name))
    ids = np.concatenate([4 * i + np.arange(4) for i, _ in seen])
    unknown = np.full(len(ids), np.nan)
    refined = Refined(
        pixels=np.concatenate([one.corners for _, one in seen]),
        sigma_px=np.concatenate([one.sigma_px for _, one in seen]),
        contrast=unknown,
        blur_px=unknown,
        reach_px=unknown,
    )
    return Found(ids, refined, "markers")


def _known(quads: Array, numbers: Ids, count: int) -> tuple[Array, Ids]:
    """Markers that the board has, each once."""
    first = np.unique(numbers, return_index=True)[1]
    keep = first[numbers[first] < count]
    return quads[keep], numbers[keep]


def _astray(corners: Array, quads: Array) -> float:
    """Median distance, in sides of a marker, of markers (M, 4, 2) px from where a plane would put them."""
    import cv2

    plane, pixels = corners[..., :2].reshape(-1, 2), quads.reshape(-1, 2)
    if len(quads) < 2:
        return 0.0
    H = cv2.findHomography(plane, pixels, cv2.LMEDS)[0]
    if H is None or not np.isfinite(H).all():
        return float("inf")
    expected = np.asarray(cv2.perspectiveTransform(plane[None], H)[0])
    side = np.linalg.norm(quads - np.roll(quads, 1, axis=1), axis=2).mean(axis=1).repeat(4)
    return float(np.median(np.linalg.norm(pixels - expected, axis=1) / side))


def _predicted(board: CharucoBoard, numbers: Ids, quads: Array) -> tuple[Ids, Array]:
    """Corners that touch enough markers that were read, and where these markers put them."""
    import cv2

    guesses: dict[int, list[Array]] = {}
    columns, rows = board.shape
    for number, quad in zip(numbers.tolist(), quads, strict=True):
        plane = np.ascontiguousarray(board.marker_corners[number, :, :2], dtype=np.float32)
        H = cv2.getPerspectiveTransform(plane, quad.astype(np.float32))
        c, r = board.marker_squares[number]
        near = [(c + a - 1, r + b - 1) for a in (0, 1) for b in (0, 1)]
        ids = [int(j * columns + i) for i, j in near if 0 <= i < columns and 0 <= j < rows]
        places = cv2.perspectiveTransform(board.points[None, ids, :2], H)[0]
        for i, place in zip(ids, places, strict=True):
            guesses.setdefault(i, []).append(np.asarray(place, dtype=np.float64))
    kept = sorted(i for i, places in guesses.items() if len(places) >= BESIDE)
    starts = np.array([np.mean(guesses[i], axis=0) for i in kept]).reshape(-1, 2)
    return np.array(kept, dtype=np.int64), starts


def _inset(board: CharucoBoard) -> float:
    """How far from the edges of the squares nothing is printed, in squares."""
    return INSET * 0.5 * (1.0 - board.marker_m / board.square_m)


def _mirrored(grey: Grey, dictionary: str, read: int) -> str:
    """Say that more markers read in the mirror image; nothing where they do not."""
    from vision3d.cv import detect_markers

    mirrored = detect_markers(np.ascontiguousarray(grey[:, ::-1]), dictionary)
    if len(mirrored.ids) < MIRROR_MARKERS + read:
        return ""
    return (
        f"the image is mirrored: {len(mirrored.ids)} markers read only when it is flipped left to right; "
        "turn the mirroring of the camera off, or flip the images back"
    )


def _without_markers(grey: Grey, dictionary: str, name: str) -> str:
    """Why no marker was read: a mirror image, another dictionary, or nothing at all."""
    from vision3d.markers import find_markers

    if said := _mirrored(grey, dictionary, 0):
        return said
    others, other = find_markers(grey, "auto")
    if other is not None and len(others) >= MIRROR_MARKERS:
        return f"no marker of {dictionary} found; I see {len(others)} of {other}: try --dictionary {other}"
    return f"no {name} found: no marker of {dictionary} could be read"


def _laid_out_otherwise(board: CharucoBoard, numbers: Ids, quads: Array) -> str:
    """Say how many columns would explain where the markers lie."""
    best, least = None, ASTRAY
    rows = int(np.ceil(2 * (numbers.max() + 1) / 3)) + 2
    for columns in range(3, 31):
        for legacy in (False, True):
            light = [
                (c, r) for r in range(rows) for c in range(columns)
                if (c + r) % 2 != ((board.rows + 1) % 2 if legacy else 0)
            ]  # fmt: skip
            if len(light) <= numbers.max():
                continue
            squares = np.array(light)[numbers]
            corners = squares[:, None, :] + board.marker_corners[0, :, :2] / board.square_m % 1.0
            if (error := _astray(corners, quads)) < least:
                best, least = columns, error
    told = f"they lie as on a board {best} squares wide" if best else "their places fit no ChArUco board"
    return f"{len(numbers)} markers were read, but not where a {board.name} has them: {told}"
