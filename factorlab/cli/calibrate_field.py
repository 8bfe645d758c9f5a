"""`factorlab calibrate mag|range|ferraris`: a magnetometer, a distance sensor, an IMU in nine sections."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.delivery import header_option, require_output
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import opened, recording_options
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.report.document import Document
    from sequential.sensors import ImuCalibration, ImuRecording

__all__ = ["ferraris", "mag", "range_sensor"]

OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.option("--verify", "verify_with", metavar="FILE", help="Try the constants on another recording."),
    as_json,
    click.option(
        "-o",
        "--out",
        type=click.Path(path_type=Path),
        metavar="DIR",
        help="Write the report, calibration.json and calibration.h here.",
    ),
    header_option,
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR, or over FILE.h."),
    check_option,
    config_option,
)
more_than_zero = click.FloatRange(min=0, min_open=True)


def delivery_options(command: Command) -> Command:
    """The options that the three commands have in common."""
    return with_options(command, OPTIONS)


@click.command(short_help="Magnetometer, from turns in every direction.")
@click.argument("source", metavar="LOG")
@recording_options
@click.option("--field", type=more_than_zero, metavar="UT",
              help="Strength of the local field, 25 to 65 µT.  [default: the raw unit is kept]")  # fmt: skip
@click.option("--noise", type=more_than_zero, metavar="SIGMA",
              help="Noise of a reading, raw unit.  [default: from differences of neighbours]")  # fmt: skip
@click.option("--planar/--space", default=None,
              help="Turns about one axis only, or in all directions.  [default: as it looks]")  # fmt: skip
@click.option("--sphere", is_flag=True, help="Hard iron alone, gains equal: for few directions.")
@click.option("--align", type=click.Choice(("gyro", "accel")),
              help="Find the rotation to the frame of this sensor, from the same recording.")  # fmt: skip
@delivery_options
@in_one_sentence
def mag(source: str, **options: Any) -> int:
    """Hard and soft iron of a magnetometer: the ellipsoid of its readings becomes a sphere.

    LOG is a recording in which the sensor was turned in every direction for half a minute or more.  Outliers
    get no weight, noise is accounted for, and gains that the directions leave free are named.
    """
    from factorlab.calibration.magnetometer import magnetometer_document
    from sequential.sensors import ImuCalibration, MagnetometerEllipsoid

    _require_free(options)
    recording = _recording(source, options)
    settings = MagnetometerEllipsoid(options["field"], options["noise"], options["planar"], options["sphere"])
    fit = settings.calibrate(recording)
    alignment = None
    if options["align"] is not None:
        from sequential.sensors import align_field

        alignment = align_field(fit, recording, options["align"])
        fit = alignment.fit
    trial = None
    if options["verify_with"] is not None:
        other = _recording(options["verify_with"], options)
        trial = (other.name, fit.verify(other))
    command = command_line()
    document = magnetometer_document(fit, recording, command, trial, alignment)
    return _deliver(document, options, _imu_files(ImuCalibration(mag=fit.calibration), recording, command))


@click.command(name="range", short_help="Distance sensor v = a/(d+b)+c.")
@click.argument("source", metavar="TABLE.csv")
@click.option("--distance", metavar="COLUMN", help="Column of true distances.  [default: distance, d]")
@click.option("--reading", metavar="COLUMN", help="Column of readings.  [default: voltage, reading, v]")
@click.option("--limit", type=more_than_zero, metavar="D",
              help="Largest useful standard deviation of the distance, in the table's unit.")  # fmt: skip
@click.option("--relative", type=more_than_zero, default=5.0, show_default=True, metavar="PERCENT",
              help="The same in percent of the distance, where there is no --limit.")  # fmt: skip
@click.option("--sigma", type=more_than_zero, metavar="S",
              help="Standard deviation of one reading.  [default: what the curve leaves]")  # fmt: skip
@delivery_options
@in_one_sentence
def range_sensor(source: str, **options: Any) -> int:
    """Curve of an infrared distance sensor, what a reading says about the distance, and the useful range.

    TABLE.csv has a column of true distances and one of readings; several rows may share a distance.  A branch
    at short distance where the reading falls again is found and left out.
    """
    from factorlab.calibration.distance import distance_document, distance_files
    from sequential.readers.range_table import read_range_table
    from sequential.sensors import RangeSensor

    _require_free(options)
    columns = {"distance": options["distance"], "reading": options["reading"]}
    table = read_range_table(source, **columns)
    fit = RangeSensor(sigma=options["sigma"]).fit(table.distances, table.readings)
    trial = None
    if options["verify_with"] is not None:
        other = read_range_table(options["verify_with"], **columns)
        trial = (Path(options["verify_with"]).name, other.distances, other.readings)
    name = Path(source).name
    document = distance_document(
        fit,
        name,
        unit=table.unit,
        reading_unit=table.reading_unit,
        limit=options["limit"],
        relative=options["relative"] / 100,
        trial=trial,
        command=command_line(),
    )
    return _deliver(document, options, distance_files(fit, name, table.unit, table.reading_unit))


@click.command(short_help="Six positions and three known turns.")
@click.argument("source", metavar="LOG")
@recording_options
@click.option("--sections", metavar="FILE.json",
              help="Start and end of x_p, x_a … z_rot.  [default: a column 'part', or found]")  # fmt: skip
@click.option("--gravity", type=click.FloatRange(8, 12), metavar="M/S2", help="|g|.  [default: 9.80665]")
@click.option("--turn", type=float, default=-360.0, show_default=True, metavar="DEG",
              help="Angle of the turns about the upward axis; negative is clockwise from above.")  # fmt: skip
@click.option("--tilt-sigma", type=click.FloatRange(min=0), default=0.5, show_default=True, metavar="DEG",
              help="How level the faces lie.")  # fmt: skip
@click.option("--turn-sigma", type=click.FloatRange(min=0), default=1.0, show_default=True, metavar="DEG",
              help="How exactly the turns are known.")  # fmt: skip
@delivery_options
@in_one_sentence
def ferraris(source: str, **options: Any) -> int:
    """Accelerometer and gyro from six positions and three known turns (Ferraris et al., 1995).

    LOG holds every axis up and down at rest, and one turn about each axis while it points up.  Sections come
    from --sections, from a column of labels, or are found.
    """
    import math

    from factorlab.calibration.ferraris import ferraris_document
    from sequential.readers.imu.sections import read_labels, read_section_list
    from sequential.sensors import STANDARD_GRAVITY, Ferraris, verify

    _require_free(options)
    if options["turn"] == 0:
        raise click.BadParameter("a turn of 0° shows no gain", param_hint="--turn")
    recording, path = _opened(source, options)
    if options["sections"] is not None:
        sections: Any = read_section_list(options["sections"])
    else:
        labelled = path.suffix.lower() in {".csv", ".txt", ".tsv"}
        sections = (read_labels(path) if labelled else {}) or None
    settings = Ferraris(
        gravity=options["gravity"] or STANDARD_GRAVITY,
        turn=math.radians(options["turn"]),
        tilt_sigma=math.radians(options["tilt_sigma"]),
        turn_sigma=math.radians(options["turn_sigma"]),
    )
    fit = settings.calibrate(recording, sections)
    trial = None
    if options["verify_with"] is not None:
        other = _recording(options["verify_with"], options)
        trial = verify(fit.calibration, other, gravity=abs(settings.gravity))
    command = command_line()
    document = ferraris_document(fit, recording, command, trial)
    return _deliver(document, options, _imu_files(fit.calibration, recording, command))


def _require_free(options: dict[str, Any]) -> None:
    require_output(options["out"], options["c_header"], force=options["force"])


def _recording(source: str, options: dict[str, Any]) -> ImuRecording:
    return _opened(source, options)[0]


def _opened(source: str, options: dict[str, Any]) -> tuple[ImuRecording, Path]:
    """The recording, its health told on stderr; what is unusable for the job at hand, the job says."""
    chosen = {name: options[name] for name in ("kind", "units", "columns", "rate")}
    found = opened(source, usable=False, **chosen)[0]
    return found.recording, found.path


def _imu_files(bundle: ImuCalibration, recording: ImuRecording, command: str) -> dict[str, str]:
    from sequential.sensors import c_header, kalibr_yaml

    files = {
        "calibration.json": bundle.to_json() + "\n",
        "calibration.h": c_header(bundle, source=f"{recording.name}, {command}"),
    }
    if bundle.accel is not None:
        files["kalibr_imu.yaml"] = kalibr_yaml(bundle, rate=recording.rate)
    return files


def _deliver(document: Document, options: dict[str, Any], files: dict[str, str]) -> int:
    from factorlab.cli.delivery import deliver

    chosen = {name: options[name] for name in ("as_json", "out", "force", "check", "c_header")}
    return deliver(document, files=files, **chosen)
