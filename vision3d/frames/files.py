"""Images on disk as a sequence: which files, in which order, at which times."""

from __future__ import annotations

import re
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError

__all__ = [
    "IMAGE_SUFFIXES",
    "begin_of",
    "find_images",
    "is_pattern",
    "named_by_time",
    "require_path",
    "stamps_of",
]

IMAGE_SUFFIXES = frozenset(
    (".bmp", ".jpeg", ".jpg", ".pbm", ".pgm", ".png", ".pnm", ".ppm", ".tif", ".tiff", ".webp")
)
NS_DIGITS = 16  # a name of as many digits counts nanoseconds, as in EuRoC; seconds of our time have ten


def is_pattern(text: str) -> bool:
    """Whether the text names files by a pattern, and is not simply the name of one."""
    return any(sign in text for sign in "*?[") and not Path(text).exists()


def require_path(text: str) -> Path:
    """The path of an existing file or folder.

    Raises
    ------
    DataError
        with the nearest name in its folder, where there is none.
    """
    path = Path(text)
    if path.exists():
        return path
    siblings = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
    near = get_close_matches(path.name, siblings, n=1)
    hint = f"did you mean {path.parent / near[0]}?" if near else "a camera is named by its number, as in 0"
    raise DataError(f"there is no file or folder {path}; {hint}")


def find_images(text: str) -> list[Path]:
    """Image files of a folder or of a pattern, in the order in which a person counts: 2 before 10.

    Raises
    ------
    DataError
        where there is none.
    """
    pattern = Path(text)
    if is_pattern(text):
        fixed = [part for part in pattern.parts if not any(sign in part for sign in "*?[")]
        depth = next(i for i, part in enumerate(pattern.parts) if part not in fixed)
        base = Path(*pattern.parts[:depth])
        found = list(base.glob(str(Path(*pattern.parts[depth:])))) if base.is_dir() else []
        what = f"no image matches {text}"
    else:
        found = list(pattern.iterdir())
        what = f"there is no image in the folder {text}"
    images = [path for path in found if path.suffix.lower() in IMAGE_SUFFIXES and path.is_file()]
    if not images:
        kinds = ", ".join(sorted(suffix[1:] for suffix in IMAGE_SUFFIXES))
        raise DataError(f"{what}; files that end in {kinds} are looked for")
    return sorted(images, key=lambda path: (str(path.parent), *_counted(path.stem), path.suffix))


def _counted(stem: str) -> tuple[tuple[str, int, str], ...]:
    """A name as words and numbers, so that names sort as they are counted."""
    return tuple((word, int(number or -1), number) for word, number in re.findall(r"(\D*)(\d*)", stem))


def stamps_of(paths: list[Path], fps: float | None, default: float) -> tuple[NDArray[np.int64], float]:
    """Times (N,) ns from 0 of image files, and their rate.

    Parameters
    ----------
    paths : in order
    fps : frames a second; None: the times that all names give (nanoseconds as in EuRoC, seconds with a
        fraction as in TUM's sets), and where they give none, `default`
    """
    if fps is None and len(paths) > 1:
        read = [_named_time(path.stem) for path in paths]
        times = np.array([t for t in read if t is not None], dtype=np.int64)
        if len(times) == len(paths) and (np.diff(times) > 0).all():
            return times - times[0], 1e9 * (len(times) - 1) / float(times[-1] - times[0])
    rate = fps or default
    return np.round(np.arange(len(paths)) * (1e9 / rate)).astype(np.int64), rate


def named_by_time(paths: list[Path]) -> bool:
    """Whether the names of several files are times: they are the frames of a video then."""
    return len(paths) > 1 and all(_named_time(path.stem) is not None for path in paths)


def begin_of(paths: list[Path]) -> int | None:
    """The time (ns) in the first name, where names are times: what `stamps_of` counts from."""
    return _named_time(paths[0].stem) if named_by_time(paths) else None


def _named_time(stem: str) -> int | None:
    if re.fullmatch(rf"\d{{{NS_DIGITS},}}", stem):
        return int(stem)
    if match := re.fullmatch(r"(\d{10})\.(\d{1,9})", stem):
        return int(match[1]) * 10**9 + int(match[2].ljust(9, "0"))
    return None
