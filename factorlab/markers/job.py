"""Read the markers of an image, a set of images or a video, with poses where the camera is known."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.frames import Frame
    from vision3d.markers import Marker, MarkerPose, MarkerTracker

__all__ = ["MarkerReading", "MarkersRead", "MarkersSettings", "read_markers"]

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class MarkersSettings:
    """What is asked for.

    Parameters
    ----------
    dictionary : by its name, or "auto"
    camera : its file; None for numbers and corners only
    which : camera in that file, where there are several
    size_m : side of the black square
    track : follow markers through time; None does so for videos
    """

    dictionary: str = "auto"
    camera: Path | None = None
    which: str | None = None
    size_m: float | None = None
    track: bool | None = None


@dataclass(frozen=True, eq=False)
class MarkerReading:
    """One marker in one frame; `alone` is the pose of that frame only, `pose` the one to use."""

    frame: int
    t_s: float
    name: str
    id: int
    marker: Marker | None
    pose: MarkerPose | None = None
    alone: MarkerPose | None = None

    @property
    def seen(self) -> bool:
        """False where the pose is a prediction."""
        return self.marker is not None


@dataclass(eq=False)
class MarkersRead:
    """What was read; `picture` is the frame with most markers, whose index is `shown`."""

    source: str
    settings: MarkersSettings
    size: tuple[int, int]
    moving: bool
    camera: Camera | None = None
    dictionary: str | None = None
    frames: int = 0
    seconds: float = 0.0
    readings: list[MarkerReading] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    picture: Image | None = None
    shown: int = -1
    left_out: tuple[str, ...] = ()
    fault: str = ""

    @property
    def ids(self) -> list[int]:
        """Numbers that were seen, each once."""
        return sorted({one.id for one in self.readings if one.seen})

    def of(self, number: int) -> list[MarkerReading]:
        """All readings of a marker."""
        return [one for one in self.readings if one.id == number]

    def in_picture(self) -> list[MarkerReading]:
        """Readings of the frame that is shown."""
        return [one for one in self.readings if one.frame == self.shown and one.seen]


def read_markers(
    source: str, settings: MarkersSettings, say: Callable[[str], object] = lambda _: None
) -> MarkersRead:
    """Read a source to its end.

    Raises
    ------
    DataError
        where the source or the camera's file cannot be read, or the camera has images of another size.
    """
    from vision3d.frames import open_frames

    if source.strip().isdecimal() or "://" in source:
        raise DataError(f"{source} is a camera; watch it with: factorlab live camera {source} --task markers")
    with open_frames(source) as frames:
        video = type(frames).__name__ == "VideoFrames"
        moving = settings.track if settings.track is not None else video
        read = MarkersRead(source, settings, frames.size, moving, dictionary=_named(settings.dictionary))
        read.camera = _camera(settings, frames.size)
        tracker = _tracker(read)
        total = f" of {frames.count}" if frames.count else ""
        for frame in frames:
            _take(read, frame, tracker)
            if video and read.frames % 100 == 0:
                say(f"{read.frames}{total} frames, {len(read.ids)} markers")
        read.left_out, read.fault = frames.left_out, frames.fault
    return read


def _named(dictionary: str) -> str | None:
    """The dictionary's own name; None where it is to be found."""
    from vision3d.boards import dictionary_name

    return None if dictionary == "auto" else dictionary_name(dictionary)


def _camera(settings: MarkersSettings, size: tuple[int, int]) -> Camera | None:
    if settings.camera is None:
        return None
    from vision3d.camera_files.reading import read_camera

    camera = read_camera(settings.camera, which=settings.which, size=size)
    if camera.size != size:
        told, given = ("x".join(map(str, one)) for one in (camera.size, size))
        raise DataError(f"{settings.camera} is of a camera with images of {told}, these are {given}")
    return camera


def _tracker(read: MarkersRead) -> MarkerTracker | None:
    if read.camera is None or read.settings.size_m is None or not read.moving:
        return None
    from vision3d.markers import MarkerTracker

    return MarkerTracker(read.camera, read.settings.size_m)


def _take(read: MarkersRead, frame: Frame, tracker: MarkerTracker | None) -> None:
    """Add one frame; the time is that of our own work, not of the decoder."""
    from vision3d.markers import find_markers, marker_poses

    t_s, began = 1e-9 * frame.t_ns, time.perf_counter()
    markers, named = find_markers(frame.image, read.dictionary or "auto", camera=read.camera)
    read.dictionary = read.dictionary or named
    new = []
    if tracker is not None:
        told = tracker.update(t_s, markers)
        new = [
            MarkerReading(frame.index, t_s, frame.name, one.id, one.marker, one.pose, one.measured)
            for one in told
        ]
        without = {one.id for one in told}
        markers = tuple(one for one in markers if one.id not in without)
    elif read.camera is not None and read.settings.size_m is not None:
        poses = marker_poses(read.camera, markers, read.settings.size_m)
        new = [
            MarkerReading(frame.index, t_s, frame.name, one.id, one, pose, pose)
            for one, pose in zip(markers, poses, strict=True)
        ]
        markers = ()
    new += [MarkerReading(frame.index, t_s, frame.name, one.id, one) for one in markers]
    read.seconds += time.perf_counter() - began
    if read.picture is None or sum(one.seen for one in new) > len(read.in_picture()):
        read.picture, read.shown = frame.image, frame.index
    read.readings += sorted(new, key=lambda one: one.id)
    read.names.append(frame.name)
    read.frames += 1
