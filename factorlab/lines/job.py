"""Read the line on the ground in every frame of a source."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.frames import Frame, open_frames
from vision3d.lines import (
    GroundHomography,
    GroundReading,
    Lane,
    LineReading,
    LineSettings,
    Scene,
    find_lane,
    find_line,
    read_scene,
)

__all__ = ["LineJob", "LineRun", "Read", "has_lane", "read_lines"]

Progress = Callable[[str, int, int], None]
OnFrame = Callable[[Frame, "Read", float], None]
KEPT = 12  # pictures that a report shows


@dataclass(frozen=True, slots=True)
class LineJob:
    """What is asked for.

    Attributes
    ----------
    settings : where to look, and for what
    ground : from pixels to metres, made when the size of the images is known; None where nothing is known
    lane : look for the two sides of a lane as well
    """

    settings: LineSettings = field(default_factory=LineSettings)
    ground: Callable[[tuple[int, int]], GroundHomography | None] = lambda _: None
    lane: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Read:
    """One frame: its name and time, the reading in pixels and, where the ground is known, in metres."""

    name: str
    t_s: float
    line: LineReading
    metres: GroundReading | None
    lane: Lane | None
    millis: float


@dataclass(frozen=True, slots=True, eq=False)
class LineRun:
    """What was read of a source.

    Attributes
    ----------
    source : as it was asked for
    size : (width, height) of the images
    reads : one a frame, in order
    pictures : some frames for a report, evenly over the source, by their number
    scene : the straight lines of the only picture; None for a video
    ground : as it was known
    fps : nominal
    fault : why the source broke off; empty where it did not
    left_out : sentences about frames that could not be used
    """

    source: str
    size: tuple[int, int]
    reads: tuple[Read, ...]
    pictures: dict[int, NDArray[np.uint8]]
    scene: Scene | None
    ground: GroundHomography | None
    job: LineJob
    fps: float
    fault: str = ""
    left_out: tuple[str, ...] = ()

    @property
    def is_picture(self) -> bool:
        """Whether there was one frame only."""
        return len(self.reads) == 1

    @property
    def found(self) -> NDArray[np.bool_]:
        """Which frames (n,) show a line, or the lane that was asked for."""
        return np.array([one.line.found or has_lane(one) for one in self.reads])


def read_lines(
    source: str,
    job: LineJob,
    progress: Progress = lambda *_: None,
    on_frame: OnFrame | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> LineRun:
    """Read every frame of a picture, a folder or a video.

    Parameters
    ----------
    source : as `vision3d.frames.open_frames` takes it
    stop : asked before every frame whether it was enough; a camera has no end of its own
    on_frame : called with every frame, what was read in it, and frames a second; such as to draw it

    Raises
    ------
    DataError
        where there is no frame.
    """
    reads: list[Read] = []
    pictures: dict[int, NDArray[np.uint8]] = {}
    last: Frame | None = None
    with open_frames(source) as frames:
        ground = job.ground(frames.size)
        every = max(1, (frames.count or KEPT) // KEPT)
        for frame in frames:
            if stop():
                break
            reads.append(_read(frame, job, ground))
            if frame.index % every == 0 and len(pictures) < 2 * KEPT:
                pictures[frame.index] = frame.image
            if on_frame is not None:
                on_frame(frame, reads[-1], frames.fps)
            progress(frame.name, frame.index + 1, frames.count or frame.index + 1)
            last = frame
        if last is None:
            told = f": {frames.fault}" if frames.fault else ""
            raise DataError(f"{source} has no frame that can be read{told}")
        return LineRun(
            source=source,
            size=frames.size,
            reads=tuple(reads),
            pictures=pictures,
            scene=read_scene(last.image) if len(reads) == 1 else None,
            ground=ground,
            job=job,
            fps=frames.fps,
            fault=frames.fault,
            left_out=frames.left_out,
        )


def has_lane(read: Read) -> bool:
    """Whether a lane was asked for and found."""
    return read.lane is not None and read.lane.found


def _read(frame: Frame, job: LineJob, ground: GroundHomography | None) -> Read:
    begin = time.perf_counter()
    line = find_line(frame.image, job.settings)
    metres = None
    if line.found and ground is not None:
        try:
            metres = ground.read(line)
        except DataError:  # the row that looks ahead shows the horizon: pixels are all there is
            metres = None
    lane = find_lane(frame.image) if job.lane else None
    millis = 1e3 * (time.perf_counter() - begin)
    return Read(frame.name, 1e-9 * frame.t_ns, line, metres, lane, millis)
