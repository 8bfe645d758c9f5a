"""`factorlab markers … --map`: a video, perhaps with an IMU's recording, becomes a map."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.clock import ClockOffset, clock_offset, require_overlap
from factorlab.marker_map.mapping import USUAL, Inertial, MarkerMap, map_markers
from sequential.errors import DataError, SolverError
from sequential.noise import ImuNoise
from vision3d.markers.sightings import MarkerSightings

if TYPE_CHECKING:
    from factorlab.marker_map.extrinsics import Extrinsics
    from factorlab.marker_map.filter import FilterRun
    from sequential.sensors.recording import ImuRecording
    from vision3d.camera import Camera
    from vision3d.frames import FrameSource
    from vision3d.markers import Marker

__all__ = ["MapJob", "MapSettings", "map_job", "read_sightings"]

Array = NDArray[np.float64]
STILL_S = 10.0  # photographs are that far apart: nothing ties one pose to the next
SUSPECT_S, POOR = 4e-3, 0.8
REACH_S = 0.3  # offsets looked for where the clocks are said to agree


@dataclass(frozen=True, eq=False)
class MapSettings:
    """What is asked for.

    Parameters
    ----------
    size_m : side of the black square
    dictionary : by name, or "auto"
    reference : number of the marker at the origin, or None
    extrinsics : where the camera sits on the IMU; without an IMU not needed
    noise : of the IMU; None for that of a consumer's MEMS
    offset_s : IMU time is camera time plus this; None takes that of the extrinsics, NaN finds it
    stamps : table with the time of every frame by the camera's clock, or None for the source's own
    """

    size_m: float
    dictionary: str = "auto"
    reference: int | None = None
    extrinsics: Extrinsics | None = None
    noise: ImuNoise | None = None
    offset_s: float | None = None
    stamps: Path | None = None


@dataclass(frozen=True, eq=False)
class MapJob:
    """A map and how it came about.

    Parameters
    ----------
    vision : the map of the camera alone, where there is an IMU
    filtered : an error-state EKF on the same data and in the map's gauge; None where it could not begin,
        for the reason in `filter_fault`
    clock : what the turns say about the clocks, on top of the offset used
    searched : whether the offset was found from the turns
    """

    source: str
    settings: MapSettings
    found: MarkerMap
    frames: int
    dictionary: str | None
    vision: MarkerMap | None = None
    filtered: FilterRun | None = None
    filter_fault: str = ""
    clock: ClockOffset | None = None
    offset_s: float = 0.0
    searched: bool = False
    left_out: tuple[str, ...] = ()
    fault: str = ""
    seconds: float = 0.0


def read_sightings(
    source: str,
    camera: Camera,
    settings: MapSettings,
    *,
    timed: bool,
    say: Callable[[str], object] = lambda _: None,
) -> tuple[MarkerSightings, str | None, tuple[str, ...], str]:
    """Markers of every frame of a source: sightings, dictionary, what was left out, and what broke off.

    `timed` asks for the times of frames, which photographs need not have.

    Raises
    ------
    DataError
        where the source cannot be read, has images of another size, or frames whose times nobody says.
    """
    from vision3d.boards import dictionary_name
    from vision3d.frames import open_frames
    from vision3d.markers import find_markers

    name = None if settings.dictionary == "auto" else dictionary_name(settings.dictionary)
    rows: list[tuple[Marker, ...]] = []
    times: list[int] = []
    with open_frames(source) as frames:
        size, count = frames.size, frames.count
    if camera.size != size:
        told, given = ("x".join(map(str, one)) for one in (camera.size, size))
        raise DataError(f"the camera's file is of images of {told}, those of {source} are {given}")
    opened, images = _opened(source, settings.stamps, timed=timed)
    for t_ns, image in images:
        markers, named = find_markers(image, name or "auto", camera=camera)
        name = name or named
        rows.append(markers)
        times.append(t_ns)
        if len(rows) % 100 == 0:
            say(f"{len(rows)}{f' of {count}' if count else ''} frames")
    sightings = MarkerSightings.from_frames(camera, settings.size_m, zip(times, rows, strict=True))
    return sightings, name, opened.left_out, opened.fault


def _opened(
    source: str, stamps: Path | None, *, timed: bool
) -> tuple[FrameSource, Iterator[tuple[int, NDArray[np.uint8]]]]:
    """A source, and its frames with their times (ns); photographs without a time are far apart."""
    from factorlab.cam_imu.stamped import open_stamped
    from vision3d.frames import open_frames

    if timed or stamps is not None:
        stamped = open_stamped(source, stamps)
        return stamped.source, ((t_ns, image) for _, t_ns, image in stamped.each())
    frames = open_frames(source)
    return frames, _far_apart(frames)


def _far_apart(frames: FrameSource) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    with frames:
        for frame in frames:
            yield round(frame.index * STILL_S * 1e9) if frame.still else frame.t_ns, frame.image


def map_job(
    source: str,
    sightings: MarkerSightings,
    settings: MapSettings,
    imu: ImuRecording | None = None,
    *,
    dictionary: str | None = None,
    say: Callable[[str], object] = lambda _: None,
) -> MapJob:
    """The map; with an IMU also that of the camera alone, what the clocks say, and a filter beside it.

    Raises
    ------
    DataError
        where camera and IMU have no time in common, or no turn tells the offset that is to be found.
    """
    began, count = perf_counter(), len(sightings.t)
    if imu is None:
        found = map_markers(sightings, reference=settings.reference)
        return MapJob(source, settings, found, count, dictionary, seconds=perf_counter() - began)
    imu.require("accel", "gyro")
    mount = settings.extrinsics
    if mount is None:
        raise DataError(
            "with an IMU the mount of the camera on it is needed: --extrinsics camchain-imucam.yaml"
        )
    say("the map of the camera alone")
    alone = map_markers(sightings, reference=settings.reference)
    searched = settings.offset_s is not None and bool(np.isnan(settings.offset_s))
    offset = _found_offset(alone, mount, imu) if searched else settings.offset_s
    offset = mount.offset_s if offset is None else offset
    require_overlap(sightings.t + round(offset * 1e9), imu)
    shifted = replace(imu, t=imu.t - round(offset * 1e9))
    clock = clock_offset(alone.t, alone.trajectory, mount.body_T_camera, shifted, reach_s=REACH_S)
    say("the map with the IMU")
    inertial = Inertial(imu, mount.body_T_camera, settings.noise or USUAL, offset)
    try:
        found = map_markers(sightings, inertial, reference=settings.reference)
    except (DataError, SolverError) as fault:
        raise type(fault)(f"{fault}{_of_the_clocks(clock, offset)}") from fault
    seconds = perf_counter() - began
    say("a filter beside it")
    filtered, told = _filtered(found)
    return MapJob(
        source, settings, found, count, dictionary, alone, filtered, told, clock, offset, searched,
        seconds=seconds,
    )  # fmt: skip


def _of_the_clocks(clock: ClockOffset | None, offset: float) -> str:
    """What the turns say, behind a fault that may come from it."""
    if clock is None:
        return ""
    if clock.explained < POOR:
        share = 100.0 * clock.explained
        return f"; the gyro explains {share:.0f} % of the camera's turns: suspect the mount or the units"
    if abs(clock.offset_s) > SUSPECT_S + 3.0 * clock.sigma_s:
        return (
            f"; the turns say that the clocks are {1e3 * clock.offset_s:.0f} ms apart: "
            f"give --time-offset {offset + clock.offset_s:.4f}"
        )
    return ""


def _found_offset(alone: MarkerMap, mount: Extrinsics, imu: ImuRecording) -> float:
    told = clock_offset(alone.t, alone.trajectory, mount.body_T_camera, imu)
    if told is None:
        raise DataError(
            "no offset between the clocks can be found from the turns: the camera hardly turns while it "
            "sees markers; record some brisk turns, or give --time-offset S"
        )
    return told.offset_s


def _filtered(found: MarkerMap) -> tuple[FilterRun | None, str]:
    """The filter, or why there is none: what is only beside the map does not stop it."""
    from factorlab.marker_map.filter import filter_markers

    assert found.inertial is not None  # noqa: S101 - asked for with one only
    row = found.reference
    try:
        return filter_markers(found.sightings, found.inertial, row, found.poses[row]), ""
    except (DataError, np.linalg.LinAlgError) as fault:
        return None, str(fault)
