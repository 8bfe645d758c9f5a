"""`factorlab markers … --map DIR`: the options of a map, and the work behind them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.settings import Command, command_line, with_options

if TYPE_CHECKING:
    from factorlab.marker_map.job import MapJob, MapSettings
    from sequential.sensors import ImuRecording

__all__ = ["map_options", "only_with_map", "run_map"]

FILE = click.Path(dir_okay=False, path_type=Path)
OPTIONS = (
    click.option("--map", "map_out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Place the markers; write map.json, map.yaml, trajectories and the report here."),
    click.option("--imu", metavar="LOG", help="With --map: recording of an IMU on the same body."),
    click.option("--extrinsics", type=FILE, metavar="FILE",
                 help="With --imu: Kalibr's camchain-imucam, T_cam_imu and timeshift_cam_imu."),
    click.option("--imu-noise", type=FILE, metavar="FILE",
                 help="With --imu: Kalibr's imu.yaml, of `characterize`.  [default: a usual MEMS]"),
    click.option("--time-offset", metavar="S",
                 help="With --imu: IMU time less camera time, s; auto finds it from the turns."),
    click.option("--stamps", type=FILE, metavar="FILE",
                 help="Times of the frames: a table with one row a frame, as `live` writes it."),
    click.option("--reference", type=int, metavar="ID",
                 help="With --map: marker at the origin.  [default: the one that most hang on]"),
    click.option("--demo", is_flag=True, help="A map of a simulated room, camera and IMU."),
)  # fmt: skip
ONLY = ("imu", "extrinsics", "imu_noise", "time_offset", "stamps", "reference")
OF_IMU = ("extrinsics", "imu_noise", "time_offset", "kind", "units", "columns", "rate")


def map_options(command: Command) -> Command:
    """Give a command the options of a map."""
    return with_options(command, OPTIONS)


def only_with_map(options: dict[str, Any]) -> None:
    """Refuse options that mean nothing without --map."""
    for name in (*ONLY, *OF_IMU):
        if options[name] is not None:
            raise click.UsageError(f"--{name.replace('_', '-')} goes with --map DIR")


def run_map(source: str | None, options: dict[str, Any]) -> int:
    """Read, solve, and deliver."""
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.marker_map.document import map_document
    from factorlab.marker_map.export import map_files

    _require_sense(source, options)
    out = options["map_out"]
    require_output(out, None, force=options["force"])
    job = _demo(options) if options["demo"] else _read(str(source), options)
    return deliver(
        map_document(job, command_line()), as_json=options["as_json"], out=out, force=options["force"],
        check=options["check"], files=map_files(job) if out is not None else None,
    )  # fmt: skip


def _require_sense(source: str | None, options: dict[str, Any]) -> None:
    """Say what is missing, or too much."""
    if options["out"] is not None:
        raise click.UsageError("--map DIR is the folder of the map; leave out -o")
    if options["demo"]:
        _require_alone(source, options)
        return
    if source is None:
        raise click.UsageError("give SOURCE: a video or a folder of pictures; or --demo")
    for name in ("camera", "size"):
        if options[name] is None:
            raise click.UsageError(f"a map needs --{name}: markers are placed in metres")
    if options["imu"] is None:
        for name in OF_IMU:
            if options[name] is not None:
                raise click.UsageError(f"--{name.replace('_', '-')} goes with --imu LOG")
    elif options["extrinsics"] is None:
        raise click.UsageError(
            "--imu needs --extrinsics FILE with T_cam_imu, where the camera sits on the IMU; "
            "`factorlab calibrate cam-imu` finds it"
        )


def _require_alone(source: str | None, options: dict[str, Any]) -> None:
    """Refuse files beside --demo."""
    for name in ("camera", "size", *OF_IMU, "stamps", "imu"):
        if options[name] is not None:
            raise click.UsageError(f"--demo brings its own; leave out --{name.replace('_', '-')}")
    if source is not None:
        raise click.UsageError("--demo brings its own sightings; leave out SOURCE")


def _settings(options: dict[str, Any]) -> MapSettings:
    from factorlab.cli.markers import _settings as markers_settings
    from factorlab.marker_map.extrinsics import read_extrinsics
    from factorlab.marker_map.job import MapSettings
    from sequential.readers.kalibr import read_kalibr_imu

    plain = markers_settings(options)
    mount, noise = options["extrinsics"], options["imu_noise"]
    return MapSettings(
        plain.size_m,
        plain.dictionary,
        options["reference"],
        None if mount is None else read_extrinsics(mount, options["which"] if _several(mount) else None),
        None if noise is None else read_kalibr_imu(noise).noise,
        _offset(options["time_offset"]),
        options["stamps"],
    )


def _several(path: Path) -> bool:
    """Whether a file has mounts of several cameras, so that --which is of it too."""
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    return text.count("T_cam_imu") > 1


def _offset(text: str | None) -> float | None:
    if text is None or text == "auto":
        return None if text is None else math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise click.BadParameter(
            f"{text!r} is neither a number of seconds nor auto", param_hint="--time-offset"
        )
    return value


def _read(source: str, options: dict[str, Any]) -> MapJob:
    """Frames and IMU of files."""
    from dataclasses import replace

    from factorlab.marker_map.job import map_job, read_sightings
    from vision3d.camera_files.reading import read_camera

    settings = _settings(options)
    imu = _imu(options)
    camera = read_camera(options["camera"], which=options["which"], size=_size(source))
    sightings, name, left_out, fault = read_sightings(
        source, camera, settings, timed=imu is not None, say=_say
    )
    job = map_job(source, sightings, settings, imu, dictionary=name, say=_say)
    return replace(job, left_out=left_out, fault=fault)


def _imu(options: dict[str, Any]) -> ImuRecording | None:
    if options["imu"] is None:
        return None
    from factorlab.cli.recording import opened

    given = {key: options[key] for key in ("kind", "units", "columns", "rate")}
    return opened(options["imu"], only=("accel", "gyro"), **given)[0].recording


def _size(source: str) -> tuple[int, int]:
    from vision3d.frames import open_frames

    with open_frames(source) as frames:
        return frames.size


def _demo(options: dict[str, Any]) -> MapJob:
    from factorlab.marker_map.demo import demo_job

    return demo_job(reference=options["reference"], say=_say)


def _say(text: str) -> None:
    click.echo(text, err=True)
