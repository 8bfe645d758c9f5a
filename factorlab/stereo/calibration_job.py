"""From pairs of pictures of a board to a rig: detection, each camera, both together, and every check."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from factorlab.camera.calibrated import CameraSettings
from factorlab.camera.fitting import Fitted, fitted
from factorlab.camera.job import silent, timed
from factorlab.stereo.calibrated import CalibratedStereo, StereoSettings
from factorlab.stereo.pair_pictures import PicturePairs, open_pairs
from sequential.errors import DataError, FactorlabError
from vision3d.stereo.view_pairs import ViewPair

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.stereo.calibration import StereoCalibration
    from vision3d.stereo.held_out import HeldOut
    from vision3d.views import Detections, View

__all__ = ["calibrate_held_pairs", "calibrate_stereo_pictures"]

Say = Callable[[str], None]
Progress = Callable[[str, int, int], None]  # what is being done, how much of it, out of how much
SIDES = ("left", "right")


def calibrate_stereo_pictures(
    left: Sequence[str],
    right: Sequence[str],
    settings: StereoSettings,
    *,
    say: Say = silent,
    progress: Progress = silent,
) -> CalibratedStereo:
    """Calibrate from files: names, patterns, folders, two videos.

    Parameters
    ----------
    say : told in a sentence what could not be used
    progress : told what is being done

    Raises
    ------
    DataError
        where nothing can be read, pictures cannot be paired, or too few pairs show the board.
    UnderConstrainedError
        where the views leave a focal length free; it says which pose is missing.
    """
    pictures = open_pairs(left, right, settings.frames)
    for one in pictures.left_out:
        say(f"left out: {one}")
    return calibrate_held_pairs(pictures, settings, say=say, progress=progress)


def calibrate_held_pairs(
    pictures: PicturePairs, settings: StereoSettings, *, say: Say = silent, progress: Progress = silent
) -> CalibratedStereo:
    """Calibrate from pairs in memory.  Raises as `calibrate_stereo_pictures`."""
    from vision3d.stereo.deviations import deviations

    seconds: dict[str, float] = {}
    cameras = tuple(
        None if path is None else known_camera(path, size)
        for path, size in zip(settings.cameras, pictures.sizes, strict=True)
    )
    with timed(seconds, "detection"):
        detections = tuple(_detected(pictures, side, settings, say, progress) for side in (0, 1))
    pairs = paired(pictures, (detections[0], detections[1]))
    total = len(pictures.pairs)
    progress("the cameras", total, total)
    with timed(seconds, "cameras"):
        alone = tuple(_alone(pairs, side, settings, cameras[side], say) for side in (0, 1))
    progress("the rig", total, total)
    with timed(seconds, "rig"):
        fit, held = _together(pairs, settings, (alone[0], alone[1]), (cameras[0], cameras[1]))
    for one in fit.disagreeing:
        say(str(one))
    with timed(seconds, "checks"):
        apart = deviations(fit)
    return CalibratedStereo(
        settings, pictures, (detections[0], detections[1]), (alone[0], alone[1]), fit, held, apart, seconds
    )


def known_camera(path: Path, size: tuple[int, int]) -> Camera:
    """The camera of a file, which has to be of the pictures' size.

    Raises
    ------
    DataError
        where there is none, or it is of another size.
    """
    from vision3d.camera_files import read_camera

    camera = read_camera(path, size=size)
    if camera.size != size:
        raise DataError(
            f"{path} is a camera of {camera.size[0]}x{camera.size[1]} pixels, and its pictures are "
            f"{size[0]}x{size[1]}; use pictures of that size, or calibrate at theirs"
        )
    return camera


def paired(pictures: PicturePairs, detections: tuple[Detections, Detections]) -> tuple[ViewPair, ...]:
    """Views of the pairs in which a camera saw the board."""
    views: tuple[dict[str, View], ...] = tuple({view.name: view for view in one.views} for one in detections)
    found = []
    for pair in pictures.pairs:
        sides = [
            None if one is None else views[side].get(one[0])
            for side, one in enumerate((pair.left, pair.right))
        ]
        if any(view is not None for view in sides):
            found.append(ViewPair(pair.name, sides[0], sides[1]))
    return tuple(found)


def _detected(
    pictures: PicturePairs, side: int, settings: StereoSettings, say: Say, progress: Progress
) -> Detections:
    from vision3d.calibrate.detection import detect_views

    images = pictures.side(side)

    def seen(count: int, name: str) -> None:
        progress(name, count, len(images))

    detections = detect_views(images, settings.board, window=settings.window, progress=seen)
    for one in detections.missed:
        say(f"{one.name}: {one.reason}")
    for text in detections.findings:
        say(f"{SIDES[side]}: {text}")
    if not detections.views:
        why = " ".join(detections.findings) or (detections.missed[0].reason if detections.missed else "")
        raise DataError(
            f"none of the {len(images)} {SIDES[side]} pictures shows a {settings.board.name}: {why}"
        )
    return detections


def _alone(
    pairs: tuple[ViewPair, ...], side: int, settings: StereoSettings, known: Camera | None, say: Say
) -> Fitted | None:
    """One camera from its own pictures, its lens chosen; None where it is known."""
    if known is not None:
        return None
    views = tuple(view for pair in pairs if (view := pair.left if side == 0 else pair.right) is not None)
    own = CameraSettings(settings.board, settings.lens, settings.window, settings.robust, settings.shape)
    try:
        return fitted(views, own, lambda text: say(f"{SIDES[side]}: {text}"))
    except FactorlabError as error:
        raise type(error)(f"the {SIDES[side]} camera: {error}") from error


def _together(
    pairs: tuple[ViewPair, ...],
    settings: StereoSettings,
    alone: tuple[Fitted | None, Fitted | None],
    known: tuple[Camera | None, Camera | None],
) -> tuple[StereoCalibration, HeldOut | None]:
    from vision3d.stereo.lens_pair import calibrate_with_best_lenses

    fits = tuple(None if one is None else one.calibration for one in alone)
    # a lens that was asked for is that of both, one that is held no choice of the other
    asked = [fit.camera.lens for fit in fits if fit is not None] or ["brown5"]
    lenses = asked[0], asked[-1]
    held = tuple(
        fit.camera if camera is None and fit is not None and settings.intrinsics == "alone" else camera
        for fit, camera in zip(fits, known, strict=True)
    )
    bent = any(fit is not None and bool(fit.warp_std.any()) for fit in fits)
    return calibrate_with_best_lenses(
        pairs,
        lenses,
        cameras=(held[0], held[1]),
        start=(fits[0], fits[1]),
        robust=settings.robust,
        board_warp=bent,
    )
