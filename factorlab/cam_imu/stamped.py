"""Frames of a camera with the stamps of its clock: in their names, in a table beside them, or none."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError
from sequential.readers.imu.clock import stamps_of
from sequential.readers.imu.text_table import read_table
from sequential.readers.imu.units import scale_of
from vision3d.frames import FrameSource, open_frames

__all__ = ["StampedFrames", "open_stamped", "read_stamps"]

Image = NDArray[np.uint8]
Stamps = NDArray[np.int64]
TABLES = ("frames.csv", "data.csv", "times.txt", "timestamps.txt")
NAMES = ("captured_unix_ns", "timestamp", "t_ns", "stamp", "time", "t_s", "t")  # of columns, the best first
UNITS = {"ns": "ns", "us": "us", "ms": "ms", "s": "s"}


@dataclass(frozen=True, eq=False)
class StampedFrames:
    """Frames and when they were taken.

    Parameters
    ----------
    source : of the frames
    stamps : (n,) ns by the camera's clock, one a frame, or None where the source's own count from 0
    begin_ns : added to the source's own count
    told : where the stamps come from, in words
    absolute : they belong to a clock that others may share; a video's own count from its beginning
    """

    source: FrameSource
    stamps: Stamps | None
    begin_ns: int
    told: str
    absolute: bool

    @property
    def span_ns(self) -> tuple[int, int] | None:
        """First and last stamp, the latter by the nominal rate where it is not known; None for no length."""
        if self.stamps is not None:
            return int(self.stamps[0]), int(self.stamps[-1])
        if self.source.count is None:
            return None
        return self.begin_ns, self.begin_ns + round(1e9 * self.source.count / self.source.fps)

    def each(self, most_hz: float | None = None) -> Iterator[tuple[str, int, Image]]:
        """Names, stamps (ns) and grey images, at most so many a second."""
        least_ns = 0 if most_hz is None else round(0.98e9 / most_hz)
        last: int | None = None
        with self.source as frames:
            for frame in frames:
                if self.stamps is not None and frame.index >= len(self.stamps):
                    raise DataError(
                        f"{frames.name} has more frames than {self.told} has stamps ({len(self.stamps)}); "
                        "are they of the same recording?"
                    )
                t = self.begin_ns + frame.t_ns if self.stamps is None else int(self.stamps[frame.index])
                if last is not None and t - last < least_ns:
                    continue
                last = t
                yield frame.name, t, frame.grey


def open_stamped(source: str | Path, stamps: Path | None = None, fps: float | None = None) -> StampedFrames:
    """Open a video or a folder of frames, and find its stamps.

    Parameters
    ----------
    source : a video, a folder of images (also EuRoC's `cam0`), or a pattern
    stamps : a table with a stamp for every frame, in order: a column, or `frames.csv` of `factorlab live`
    fps : frames a second, where nothing else says when frames were taken

    Raises
    ------
    DataError
        where frames have no times.
    """
    path = Path(source)
    if (path / "data").is_dir() and not any(path.glob("*.png")):
        path = path / "data"
    frames = open_frames(path, fps=fps)
    if stamps is None and fps is None:
        beside = path.parent if path.is_file() else path
        stamps = next((beside / name for name in TABLES if (beside / name).is_file()), None)
    if stamps is not None and frames.begin_ns is None:
        own = read_stamps(stamps)
        if frames.count is not None and abs(len(own) - frames.count) > max(2, frames.count // 50):
            raise DataError(
                f"{stamps} holds {len(own)} stamps and {source} {frames.count} frames; they belong to "
                "different recordings, or one was cut"
            )
        return StampedFrames(frames, own, 0, stamps.name, absolute=True)
    if frames.begin_ns is not None:
        return StampedFrames(frames, None, frames.begin_ns, "the names of the files", absolute=True)
    if frames.stills and fps is None:
        raise DataError(
            f"the images of {source} say nothing of when they were taken; name them by their time as EuRoC "
            "does (1403636579763555584.png), or give --stamps FILE with one stamp a frame, or --fps"
        )
    told = (
        f"{frames.fps:g} frames a second, as given"
        if fps is not None
        else "the video's own, from its beginning"
    )
    return StampedFrames(frames, None, 0, told, absolute=False)


def read_stamps(path: Path) -> Stamps:
    """Stamps (n,) ns of a table: the column whose name says so, or the first.

    Raises
    ------
    FileFormatError
        where they do not increase.
    """
    table = read_table(path, lambda cells: any(_bare(cell)[0] in NAMES for cell in cells))
    names = [_bare(cell) for cell in table.header]
    found = next((k for name in NAMES for k, (bare, _) in enumerate(names) if bare == name), 0)
    unit = names[found][1] if names else ""
    stamps, _ = stamps_of(table.text(found), scale_of("t", unit) if unit else None, str(path))
    if (np.diff(stamps) <= 0).any():
        k = int(np.flatnonzero(np.diff(stamps) <= 0)[0]) + 1
        raise FileFormatError(f"{path}: the stamp of frame {k} is not after the one before it")
    return stamps


def _bare(cell: str) -> tuple[str, str]:
    """Name and unit of a column: `#timestamp [ns]`, `captured_unix_ns`, `t_s`."""
    text = cell.strip("#\"' ").lower()
    name, _, unit = text.partition("[")
    name, unit = name.strip(), unit.strip("] ")
    if not unit and name.rpartition("_")[2] in UNITS:
        unit = name.rpartition("_")[2]
    return name, unit
