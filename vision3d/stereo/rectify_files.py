"""Rectify pairs of pictures on disk; one that cannot be used costs no other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError
from vision3d.images import LeftOut, read_image
from vision3d.stereo.rectification import Rectification
from vision3d.stereo.row_check import RowCheck, check_rows

__all__ = ["Rectified", "RectifiedPair", "anaglyph", "rectify_files", "side_by_side"]

Picture = NDArray[np.uint8]
Progress = Callable[[str, int, int], None]
LINES = 16  # drawn over a pair
COLOURS = ((100, 211, 86), (96, 204, 242))  # BGR, in turn


@dataclass(frozen=True, slots=True, eq=False)
class RectifiedPair:
    """What became of one pair.

    Parameters
    ----------
    left, right : the sources
    name : of the written files, under left/ and right/
    rows : what features say of its rows; None where that was not asked for
    """

    left: Path
    right: Path
    name: str
    rows: RowCheck | None


@dataclass(frozen=True, slots=True, eq=False)
class Rectified:
    """What was written, and what was not."""

    pairs: tuple[RectifiedPair, ...]
    left_out: tuple[LeftOut, ...]


def rectify_files(
    pair: Rectification,
    sources: Sequence[tuple[Path, Path]],
    folder: Path,
    *,
    check: int = 8,
    with_anaglyph: bool = False,
    progress: Progress | None = None,
) -> Rectified:
    """Rectify pairs of pictures into the folders left/, right/ and rows/ (side by side, with lines).

    Parameters
    ----------
    pair : of the rig that took them
    sources : left and right picture of each pair
    folder : that exists
    check : in how many pairs, evenly over all, features are matched to measure rows
    with_anaglyph : write anaglyph/ too, for red and cyan glasses
    progress : hears of each pair: its name, how many are done, of how many

    Raises
    ------
    DataError
        where none of them can be rectified, with the reason of the first.
    """
    parts = ["left", "right", "rows", *(["anaglyph"] if with_anaglyph else [])]
    for part in parts:
        (folder / part).mkdir(parents=True, exist_ok=True)
    checked = set(np.linspace(0, len(sources) - 1, min(check, len(sources))).astype(int).tolist())
    written: list[RectifiedPair] = []
    left_out: list[LeftOut] = []
    for k, (left, right) in enumerate(sources):
        if progress is not None:
            progress(left.name, k, len(sources))
        try:
            images = pair.images(read_image(left, colour=None), read_image(right, colour=None))
        except (DataError, ShapeError, OSError) as error:
            left_out.append(LeftOut(f"{left.name} + {right.name}", str(error)))
            continue
        name = _free(left, {one.name for one in written})
        pictures = {"left": images[0], "right": images[1], "rows": side_by_side(*images, axis=pair.axis)}
        if with_anaglyph:
            pictures["anaglyph"] = anaglyph(*images)
        for part, image in pictures.items():
            _write(folder / part / name, image)
        rows = check_rows(*images, axis=pair.axis) if k in checked else None
        written.append(RectifiedPair(left, right, name, rows))
    if not written:
        raise DataError(f"none of the {len(sources)} pairs can be rectified; {left_out[0]}")
    return Rectified(tuple(written), tuple(left_out))


def side_by_side(left: Picture, right: Picture, *, axis: int = 0, lines: int = LINES) -> Picture:
    """Both pictures beside each other (of a vertical rig: below), with lines along which points move."""
    import cv2

    both = np.concatenate([_colour(left), _colour(right)], axis=1 - axis)
    reach = both.shape[axis]
    for k, at in enumerate(np.linspace(0, reach - 1, lines + 2)[1:-1].round().astype(int)):
        ends = ((0, int(at)), (both.shape[1] - 1, int(at)))
        if axis == 1:
            ends = ((int(at), 0), (int(at), both.shape[0] - 1))
        cv2.line(both, *ends, COLOURS[k % 2], 1)
    return both


def anaglyph(left: Picture, right: Picture) -> Picture:
    """Red from the left picture, green and blue from the right one; (h, w, 3) BGR."""
    a, b = _grey(left), _colour(right)
    return np.ascontiguousarray(np.dstack([b[..., 0], b[..., 1], a]))


def _colour(image: Picture) -> Picture:
    import cv2

    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), np.uint8) if image.ndim == 2 else image.copy()


def _grey(image: Picture) -> Picture:
    import cv2

    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


def _write(path: Path, image: NDArray[Any]) -> None:
    import cv2

    path.write_bytes(cv2.imencode(".png", image)[1].tobytes())


def _free(path: Path, taken: set[str]) -> str:
    """A name in the folder that no other pair has."""
    name, k = f"{path.stem}.png", 2
    while name in taken:
        name, k = f"{path.stem}_{k}.png", k + 1
    return name
