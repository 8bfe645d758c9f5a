"""From frames and an IMU's log to a calibration of both: detection, estimation, and every check of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.cam_imu.checked import Checked, checked
from factorlab.cam_imu.files import Mounting
from factorlab.cam_imu.numbering import numbered_alike
from factorlab.camera.job import silent, timed
from sequential.errors import DataError
from sequential.noise import ImuNoise
from sequential.sensors.recording import ImuRecording
from vision3d.inertial import CamImuCalibration, CamImuSettings, Corners, Imu, calibrate_cam_imu
from vision3d.inertial.checks import SEARCH_S, require_overlap

if TYPE_CHECKING:
    from factorlab.cam_imu.demo import Truth
    from vision3d.boards import Board
    from vision3d.camera import Camera
    from vision3d.views import View

__all__ = ["CamImuJob", "CamImuRun", "calibrate_images", "calibrate_recording", "calibrate_views", "noise_of"]

Say = Callable[[str], None]
Progress = Callable[[str, int, int], None]
Stamps = NDArray[np.int64]
Image = NDArray[np.uint8]


@dataclass(frozen=True)
class CamImuJob:
    """What is asked for.

    Parameters
    ----------
    camera : with known intrinsics
    board : at rest before it
    settings : of the estimation
    camera_name : where the camera comes from
    most_hz : frames a second that are looked at
    noise_name : the file that the IMU's noise comes from
    compare, compare_name : another calibration of the same rig, and where it comes from
    checks : also calibrate each half alone, and measure the board
    """

    camera: Camera
    board: Board
    settings: CamImuSettings = field(default_factory=CamImuSettings)
    camera_name: str = ""
    most_hz: float = 20.0
    noise_name: str = ""
    compare: Mounting | None = None
    compare_name: str = ""
    checks: bool = True


@dataclass(frozen=True, eq=False)
class CamImuRun:
    """A calibration with what it came from.

    Parameters
    ----------
    job : what was asked for
    recording : of the IMU
    found : the calibration
    checked : what parts of the recording say
    frames : looked at
    names, times : of those with the board; times in s as in `found`
    origin_ns : (camera, imu) stamps from which their times in `found` count
    stamps_from : where the frames' stamps come from
    seconds : what took how long
    truth : of a rendered demonstration
    """

    job: CamImuJob
    recording: ImuRecording
    found: CamImuCalibration
    checked: Checked | None
    frames: int
    names: tuple[str, ...]
    times: NDArray[np.float64]
    origin_ns: tuple[int, int]
    stamps_from: str
    seconds: dict[str, float]
    truth: Truth | None = None

    @property
    def time_offset_s(self) -> float:
        """Added to a camera's stamp as it was read it gives the IMU's: Kalibr's timeshift_cam_imu."""
        return (self.origin_ns[1] - self.origin_ns[0]) * 1e-9 + self.found.time_offset_s


def calibrate_recording(
    source: str | Path,
    recording: ImuRecording,
    job: CamImuJob,
    *,
    stamps: Path | None = None,
    fps: float | None = None,
    clocks: str = "auto",
    say: Say = silent,
    progress: Progress = silent,
) -> CamImuRun:
    """Calibrate from a video or a folder of frames.

    Parameters
    ----------
    source : the frames; see `factorlab.cam_imu.stamped.open_stamped`
    recording : of the IMU
    stamps, fps : of the frames
    clocks : "same": frames and IMU are stamped by clocks that agree to a second; "apart": they have nothing
        to
        do with each other; "auto" goes by where the frames' stamps come from
    say, progress : told what could not be used, and what is being done

    Raises
    ------
    DataError, UnderConstrainedError
        in a sentence: too few frames, no overlap, a motion that is missing.
    """
    from factorlab.cam_imu.stamped import open_stamped

    frames = open_stamped(source, stamps, fps)
    if frames.source.size != job.camera.size:
        told, given = ("x".join(map(str, one)) for one in (job.camera.size, frames.source.size))
        raise DataError(
            f"the camera is of images of {told}, and these are {given}; calibrate it at their size"
        )
    common = frames.absolute if clocks == "auto" else clocks == "same"
    if common and (span := frames.span_ns) is not None:  # before the board is looked for
        reach = job.settings.search_s or SEARCH_S
        ends = (1e-9 * (t - int(recording.t[0])) for t in (*span, int(recording.t[-1])))
        begin, end, last = ends
        require_overlap((begin, end), (0.0, last), (-reach, reach))
    return calibrate_images(
        frames.each(job.most_hz), recording, job, common_clock=common, stamps_from=frames.told,
        total=frames.source.count or 0, say=say, progress=progress,
    )  # fmt: skip


def calibrate_images(
    images: Iterable[tuple[str, int, Image]],
    recording: ImuRecording,
    job: CamImuJob,
    *,
    common_clock: bool = True,
    stamps_from: str = "given",
    total: int = 0,
    say: Say = silent,
    progress: Progress = silent,
) -> CamImuRun:
    """Calibrate from names, stamps (ns) and grey images.  Raises as `calibrate_recording`."""
    from vision3d.calibrate.detection import detect_views

    seconds: dict[str, float] = {}
    stamps: dict[str, int] = {}

    def named() -> Iterator[tuple[str, Image]]:
        for name, t, image in images:
            stamps[name] = t
            yield name, image

    with timed(seconds, "detection"):
        detections = detect_views(
            named(), job.board, progress=lambda done, _: progress("frames", done, max(total, done))
        )
    for text in detections.findings:
        say(text)
    if not detections.views:
        why = detections.missed[0].reason if detections.missed else "there is no frame"
        raise DataError(f"none of the {len(stamps)} frames shows a {job.board.name}: {why}")
    times = np.array([stamps[view.name] for view in detections.views], dtype=np.int64)
    return calibrate_views(
        detections.views, times, recording, job, common_clock=common_clock, stamps_from=stamps_from,
        frames=len(stamps), seconds=seconds, progress=progress,
    )  # fmt: skip


def calibrate_views(
    views: tuple[View, ...],
    stamps: Stamps,
    recording: ImuRecording,
    job: CamImuJob,
    *,
    common_clock: bool = True,
    stamps_from: str = "given",
    frames: int | None = None,
    seconds: dict[str, float] | None = None,
    progress: Progress = silent,
) -> CamImuRun:
    """Calibrate from views of the board at stamps (F,) ns.  Raises as `calibrate_recording`."""
    from dataclasses import replace

    recording.require("accel", "gyro")
    assert recording.gyro is not None  # noqa: S101 - required above
    assert recording.accel is not None  # noqa: S101
    took = {} if seconds is None else seconds
    order = np.argsort(stamps, kind="stable")
    kept = order[np.diff(stamps[order], prepend=stamps[order[0]] - 1) > 0]
    kept = kept[[len(views[k]) >= 4 for k in kept]]
    if not len(kept):
        raise DataError("no frame shows four points of the board")
    stamps, views = stamps[kept], tuple(views[k] for k in kept)
    views = numbered_alike(job.camera, job.board, views)
    origin = int(stamps[0]) if not common_clock else int(recording.t[0]), int(recording.t[0])
    times: NDArray[np.float64] = 1e-9 * (stamps - origin[0]).astype(np.float64)
    corners = corners_of(views, times)
    imu = Imu(1e-9 * (recording.t - origin[1]).astype(np.float64), recording.gyro, recording.accel)
    settings = replace(job.settings, common_clock=common_clock)
    progress("the rig", 1, 1)
    with timed(took, "estimation"):
        found = calibrate_cam_imu(job.camera, corners, imu, settings)
    with timed(took, "checks"):
        own = checked(found) if job.checks else None
    names = tuple(view.name for view in views)
    return CamImuRun(
        job,
        recording,
        found,
        own,
        len(views) if frames is None else frames,
        names,
        times,
        origin,
        stamps_from,
        took,
    )


def corners_of(views: tuple[View, ...], t: NDArray[np.float64]) -> Corners:
    """Corners of views at times (F,) s, in one table."""
    return Corners(
        t,
        np.repeat(np.arange(len(views)), [len(view) for view in views]),
        np.concatenate([view.points for view in views]),
        np.concatenate([view.pixels for view in views]),
        np.concatenate([view.sigma_px for view in views]),
    )


def noise_of(path: Path) -> ImuNoise:
    """The noise in Kalibr's `imu.yaml`."""
    from sequential.readers.kalibr import read_kalibr_imu

    return read_kalibr_imu(path).noise
