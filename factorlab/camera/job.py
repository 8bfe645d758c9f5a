"""From pictures of a board to a camera: detection, choice of the lens, adjustment, and every check of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from factorlab.camera.calibrated import CalibratedCamera, CameraSettings
from factorlab.camera.fitting import FEWEST, fitted
from sequential.errors import DataError

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.images import ImageSet
    from vision3d.views import Detections

__all__ = ["calibrate_held", "calibrate_pictures"]

Say = Callable[[str], None]
Progress = Callable[[str, int, int], None]  # what is being done, how much of it, out of how much


def silent(text: str, done: int = 0, total: int = 0) -> None:
    """Tell nobody."""


def calibrate_pictures(
    given: Sequence[str], settings: CameraSettings, *, say: Say = silent, progress: Progress = silent
) -> CalibratedCamera:
    """Calibrate from files: names, patterns, folders, videos.

    Parameters
    ----------
    say : told in a sentence what could not be used
    progress : told what is being done

    Raises
    ------
    DataError
        where nothing can be read, the board is not found, or too few views remain.
    UnderConstrainedError
        where the views leave the focal length free; it says which pose is missing.
    """
    from factorlab.camera.pictures import open_pictures

    pictures = open_pictures(given, settings.frames)
    for one in pictures.left_out:
        say(f"left out: {one}")
    other = None if settings.compare is None else compared(settings.compare, pictures.size)
    return calibrate_held(pictures, settings, other=other, say=say, progress=progress)


def compared(path: Path, size: tuple[int, int]) -> Camera:
    """The camera of a file to compare with.

    Raises
    ------
    DataError
        where there is none, or it is of another image size.
    """
    from vision3d.camera_files import read_camera

    other = read_camera(path, size=size)
    if other.size != size:
        raise DataError(
            f"{path} is a camera of {other.size[0]}x{other.size[1]} pixels, and the pictures are "
            f"{size[0]}x{size[1]}: they cannot be compared"
        )
    return other


def calibrate_held(
    pictures: ImageSet,
    settings: CameraSettings,
    *,
    other: Camera | None = None,
    say: Say = silent,
    progress: Progress = silent,
) -> CalibratedCamera:
    """Calibrate from pictures in memory; `other` is what to compare with.  Raises as `calibrate_pictures`."""
    from vision3d.calibrate import difference, leave_one_out, next_pose

    seconds: dict[str, float] = {}
    with timed(seconds, "detection"):
        detections = detected(pictures, settings, say, progress)
    progress("the lens", len(pictures), len(pictures))
    with timed(seconds, "lens"):
        found = fitted(detections.views, settings, say)
        fit = found.calibration
    with timed(seconds, "checks"):
        cross = leave_one_out(fit) if len(fit.views) > FEWEST else None
        following = next_pose(fit, settings.board) if settings.next_pose else None
        apart = None if other is None else difference(fit, other)
    return CalibratedCamera(settings, pictures, detections, found, cross, following, apart, seconds)


def detected(pictures: ImageSet, settings: CameraSettings, say: Say, progress: Progress) -> Detections:
    """Find the board in every picture.

    Raises
    ------
    DataError
        where no picture shows it.
    """
    from vision3d.calibrate.detection import detect_views

    def seen(count: int, name: str) -> None:
        progress(name, count, len(pictures))

    detections = detect_views(pictures, settings.board, window=settings.window, progress=seen)
    for one in detections.missed:
        say(f"{one.name}: {one.reason}")
    for text in detections.findings:
        say(text)
    if not detections.views:
        why = " ".join(detections.findings) or (detections.missed[0].reason if detections.missed else "")
        raise DataError(f"none of {len(pictures)} pictures shows a {settings.board.name}: {why}")
    return detections


@contextmanager
def timed(seconds: dict[str, float], what: str) -> Iterator[None]:
    """Keep how long something took."""
    began = perf_counter()
    yield
    seconds[what] = perf_counter() - began
