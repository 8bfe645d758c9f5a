"""`factorlab calibrate cam-imu`: a camera and an IMU on one rig, from a recording of both before a board."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.board_options import board_of, board_options
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import opened
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.cam_imu import CamImuJob, CamImuRun
    from sequential.sensors import ImuRecording

__all__ = ["cam_imu"]

FILE = click.Path(dir_okay=False, path_type=Path)

OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.argument("frames", metavar="FRAMES", required=False),
    click.argument("log", metavar="LOG", required=False),
    click.option("--camera", "camera_file", type=FILE, metavar="FILE",
                 help="The camera's calibration, in any format."),
    *board_options(required=False),
    click.option("--stamps", type=FILE, metavar="FILE",
                 help="A stamp for every frame.  [default: frames.csv beside them, or their names]"),
    click.option("--fps", type=click.FloatRange(min=0.5), metavar="HZ",
                 help="Frames a second, where nothing else tells when they were taken."),
    click.option("--clocks", type=click.Choice(("auto", "same", "apart")), default="auto", show_default=True,
                 help="same: stamps agree to a second; apart: they have nothing to do with each other."),
    click.option("--search", "search_s", type=click.FloatRange(min=0.01), metavar="S",
                 help="Largest offset of the clocks to look for.  [default: 1 s; all where they are apart]"),
    click.option("--imu-noise", type=FILE, metavar="FILE.yaml",
                 help="Kalibr's imu.yaml: bias walks to assume, densities to compare with."),
    click.option("--imu-model", type=click.Choice(("calibrated", "scale", "scale-misalignment")),
                 default="calibrated", show_default=True,
                 help="What is estimated of the IMU besides biases: gains, or gains and misalignment."),
    click.option("--gravity", type=click.FloatRange(8, 12), default=9.80665, show_default=True,
                 metavar="M/S2", help="Its length."),
    click.option("--most-fps", "most_hz", type=click.FloatRange(1, 200), default=20.0,
                 show_default=True, metavar="HZ", help="Frames a second that are looked at."),
    click.option("--knots", "knots_per_s", type=click.FloatRange(1, 400), metavar="N",
                 help="Knots of the trajectory a second.  [default: as many as the readings ask for]"),
    click.option("--compare", type=click.Path(path_type=Path), metavar="FILE",
                 help="Another calibration of the rig: camchain-imucam.yaml, or an earlier report's folder."),
    click.option("--checks/--no-checks", default=True, show_default=True,
                 help="Calibrate each half alone too, and measure the board by the IMU."),
    click.option("--demo", is_flag=True, help="A rendered recording whose truth is known."),
    click.option("--log-kind", metavar="KIND", help="Format of LOG, where it is not found out rightly."),
    click.option("--units", metavar="S=U,…", help="Of LOG: accel=g,gyro=deg/s,t=ms, or '16384 LSB/g'."),
    click.option("--columns", metavar="R=C,…", help="Of LOG: ax=acc_x,ay=acc_y … t=when."),
    click.option("--rate", type=click.FloatRange(min=0, min_open=True), metavar="HZ",
                 help="Of LOG, where it has no stamps."),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Write the report, Kalibr's camchain-imucam.yaml, calibration.json … here."),
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR."),
    check_option,
    config_option,
)  # fmt: skip


def cam_imu_options(command: Command) -> Command:
    """Arguments and options of the command."""
    return with_options(command, OPTIONS)


@click.command("cam-imu", short_help="Camera and IMU on one rig: rotation, translation, time offset, biases.")
@cam_imu_options
@in_one_sentence
def cam_imu(frames: str | None, log: str | None, **options: Any) -> int:
    """How a camera and an IMU are mounted to each other, and how their clocks differ.

    FRAMES is a video, a folder of images named by their time (EuRoC), or a pattern; LOG the IMU's recording.
    The board is at rest, and the rig moves: half a minute of nodding, panning, rolling by 20 to 30° about
    once a second, with some shaking along every axis, the whole board in view.  The camera's own calibration
    (factorlab calibrate camera) is held.

    Estimated are camera_T_imu, the offset of the clocks, gravity, biases that wander, the noise of all three
    sensors, and how sure each is.
    """
    from factorlab.cam_imu import cam_imu_document, cam_imu_files
    from factorlab.cli.delivery import deliver, require_output

    require_output(options["out"], None, force=options["force"])
    run = _demo(frames, options) if options["demo"] else _run(frames, log, options)
    return deliver(
        cam_imu_document(run, command_line()),
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=cam_imu_files(run) if options["out"] is not None else None,
    )


def _run(frames: str | None, log: str | None, options: dict[str, Any]) -> CamImuRun:
    from factorlab.cam_imu import calibrate_recording
    from factorlab.cli.progress import bar

    if frames is None or log is None:
        raise click.UsageError("give FRAMES (a video or a folder) and LOG (the IMU's recording), or --demo")
    for name, value in (("camera", "camera_file"), ("board", "board_text"), ("square", "square")):
        if options[value] is None:
            raise click.UsageError(
                f"--{name} is missing: the camera's calibration and the board are to be known"
            )
    job = _job(options)
    recording = _recording(log, options)
    told: list[str] = []
    try:
        with bar("cam-imu", shown=sys.stderr.isatty()) as progress:
            return calibrate_recording(
                frames, recording, job, stamps=options["stamps"], fps=options["fps"],
                clocks=options["clocks"], say=told.append, progress=progress,
            )  # fmt: skip
    finally:
        for text in told:
            click.echo(text, err=True)


def _recording(log: str, options: dict[str, Any]) -> ImuRecording:
    given = {name: options[name] for name in ("units", "columns", "rate")}
    return opened(log, only=("accel", "gyro"), kind=options["log_kind"], **given)[0].recording


def _demo(frames: str | None, options: dict[str, Any]) -> CamImuRun:
    from factorlab.cam_imu.demo import calibrate_demo
    from factorlab.cli.progress import bar

    for given, name in (
        (frames, "FRAMES and LOG"),
        (options["camera_file"], "--camera"),
        (options["board_text"], "--board"),
    ):
        if given is not None:
            raise click.UsageError(f"--demo brings frames, log, camera and board; leave out {name}")
    with bar("cam-imu", shown=sys.stderr.isatty()) as progress:
        return calibrate_demo(_settings(options), progress=progress)


def _settings(options: dict[str, Any]) -> Any:
    from factorlab.cam_imu.job import noise_of
    from vision3d.inertial import CamImuSettings

    return CamImuSettings(
        imu_model=options["imu_model"],
        gravity=options["gravity"],
        noise=None if options["imu_noise"] is None else noise_of(options["imu_noise"]),
        knots_per_s=options["knots_per_s"],
        search_s=options["search_s"],
    )


def _job(options: dict[str, Any]) -> CamImuJob:
    from factorlab.cam_imu import CamImuJob
    from factorlab.cam_imu.files import read_mounting
    from vision3d.camera_files import read_camera

    noise = options["imu_noise"]
    return CamImuJob(
        camera=read_camera(options["camera_file"]),
        board=board_of(options),
        settings=_settings(options),
        camera_name=options["camera_file"].name,
        most_hz=options["most_hz"],
        noise_name="" if noise is None else noise.name,
        compare=None if options["compare"] is None else read_mounting(options["compare"]),
        compare_name="" if options["compare"] is None else options["compare"].name,
        checks=options["checks"],
    )
