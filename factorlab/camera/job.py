"""From pictures of a board to a camera: detection, choice of the lens, adjustment, and every check of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING

from factorlab.camera.calibrated import CalibratedCamera, CameraSettings
from sequential.errors import DataError

if TYPE_CHECKING:
    from vision3d.calibrate import Calibration
    from vision3d.images import ImageSet
    from vision3d.views import Detections

__all__ = ["calibrate_held", "calibrate_pictures"]

Say = Callable[[str], None]


def silent(text: str) -> None:
    """Tell nobody."""


def calibrate_pictures(
    given: Sequence[str], settings: CameraSettings, *, say: Say = silent
) -> CalibratedCamera:
    """Calibrate from files: names, patterns, folders, videos.

    Parameters
    ----------
    say : told in a sentence what could not be used

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
    return calibrate_held(pictures, settings, say=say)


def calibrate_held(pictures: ImageSet, settings: CameraSettings, *, say: Say = silent) -> CalibratedCamera:
    """Calibrate from pictures in memory; raises as `calibrate_pictures`."""
    from vision3d.calibrate.cross_validation import leave_one_out

    seconds: dict[str, float] = {}
    with timed(seconds, "detection"):
        detections = detected(pictures, settings, say)
    with timed(seconds, "lens"):
        fit = _fitted(detections, settings)
    with timed(seconds, "checks"):
        cross = leave_one_out(fit) if len(fit.views) > 3 else None
    return CalibratedCamera(settings, pictures, detections, fit, cross, seconds)


def detected(pictures: ImageSet, settings: CameraSettings, say: Say) -> Detections:
    """Find the board in every picture.

    Raises
    ------
    DataError
        where no picture shows it.
    """
    from vision3d.calibrate.detection import detect_views

    detections = detect_views(pictures, settings.board, window=settings.window)
    for one in detections.missed:
        say(f"{one.name}: {one.reason}")
    for text in detections.findings:
        say(text)
    if not detections.views:
        why = " ".join(detections.findings) or (detections.missed[0].reason if detections.missed else "")
        raise DataError(f"none of {len(pictures)} pictures shows a {settings.board.name}: {why}")
    return detections


def _fitted(detections: Detections, settings: CameraSettings) -> Calibration:
    """The calibration, with the lens asked for."""
    from vision3d.calibrate import calibrate

    lens = "brown5" if settings.lens == "auto" else settings.lens
    return calibrate(detections.views, lens, robust=settings.robust)


@contextmanager
def timed(seconds: dict[str, float], what: str) -> Iterator[None]:
    """Keep how long something took."""
    began = perf_counter()
    yield
    seconds[what] = perf_counter() - began
