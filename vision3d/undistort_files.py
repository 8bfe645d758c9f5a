"""Undistort pictures and videos on disk; one that cannot be used costs no other."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from sequential.errors import DataError, FileFormatError, ShapeError
from vision3d.frames import open_frames
from vision3d.frames.files import IMAGE_SUFFIXES
from vision3d.images import LeftOut, read_image
from vision3d.undistort import Undistorter

__all__ = ["Undistorted", "undistort_files"]

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Undistorted:
    """What was written, and what was not.

    Parameters
    ----------
    written : (source, name of the file in the folder)
    left_out : sources that were not undistorted, each with its reason
    """

    written: tuple[tuple[str, str], ...]
    left_out: tuple[LeftOut, ...]


def undistort_files(
    undistorter: Undistorter, paths: Iterable[Path], folder: Path, *, progress: Progress | None = None
) -> Undistorted:
    """Undistort files into a folder: pictures as PNG, videos as Motion-JPEG in AVI.

    Parameters
    ----------
    undistorter : of the camera that took them
    paths : pictures and videos
    folder : that exists
    progress : hears of each file: its name, how many are done, of how many

    Raises
    ------
    DataError
        where none of them can be undistorted, with the reason of the first.
    """
    files = list(paths)
    written: list[tuple[str, str]] = []
    left_out: list[LeftOut] = []
    for i, path in enumerate(files):
        if progress is not None:
            progress(path.name, i, len(files))
        still = path.suffix.lower() in IMAGE_SUFFIXES
        name = _free_name(path, ".png" if still else ".avi", {taken for _, taken in written})
        try:
            (_picture if still else _video)(undistorter, path, folder / name)
        except (DataError, OSError) as error:
            left_out.append(LeftOut(str(path), str(error).removeprefix(f"{path} ")))
        else:
            written.append((str(path), name))
    if not written:
        raise DataError(f"none of the {len(files)} files can be undistorted; {left_out[0]}")
    return Undistorted(tuple(written), tuple(left_out))


def _picture(undistorter: Undistorter, source: Path, target: Path) -> None:
    import cv2

    straight = undistorter(read_image(source, colour=None))
    target.write_bytes(cv2.imencode(".png", straight)[1].tobytes())


def _video(undistorter: Undistorter, source: Path, target: Path) -> None:
    import cv2

    with open_frames(source) as frames:
        if frames.size != undistorter.camera.size:
            width, height = undistorter.camera.size
            raise ShapeError(
                f"is {frames.size[0]}x{frames.size[1]} px and the camera was calibrated at {width}x{height}"
            )
        codec = cv2.VideoWriter.fourcc(*"MJPG")
        writer = cv2.VideoWriter(str(target), codec, frames.fps, undistorter.target.size)
        if not writer.isOpened():
            raise FileFormatError("this OpenCV cannot write a Motion-JPEG video")
        try:
            for frame in frames:
                writer.write(undistorter(frame.image))
        finally:
            writer.release()


def _free_name(path: Path, suffix: str, taken: set[str]) -> str:
    """A name in the folder: that of the source, with its folder's name or a number where it is taken."""
    stems = [path.stem, f"{path.parent.name}_{path.stem}"]
    stems += [f"{path.stem}_{i}" for i in range(2, len(taken) + 3)]
    return next(f"{stem}{suffix}" for stem in stems if f"{stem}{suffix}" not in taken)
