"""What `factorlab attitude` says: verdicts, sections, and the same numbers for a machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.attitude.solve import Reference, Solved
from factorlab.report.document import Document, Section, Status, Table, Verdict
from sequential.sensors import ImuRecording
from sequential.sensors.finding import Finding

__all__ = ["attitude_document"]

HONEST, PLAUSIBLE = (0.90, 0.98), (0.85, 0.99)
LARGE_BIAS = 1.0  # °/s
MUCH = 0.25  # of the time
STEEP = 70.0  # °


def attitude_document(
    recording: ImuRecording,
    solved: tuple[Solved, ...],
    reference: Reference | None = None,
    findings: tuple[Finding, ...] = (),
    *,
    calibrated: str = "",
    command: str = "",
) -> Document:
    """Tell what estimators made of a recording; the first is the answer, the others stand beside it."""
    first = solved[0]
    sensors = (
        "9-D (gyro, accelerometer, magnetometer)"
        if recording.mag is not None
        else "6-D (gyro, accelerometer)"
    )
    lead = (
        f"{recording.duration:.1f} s at {recording.rate:.1f} Hz, {sensors}, {first.title}"
        f"{'' if not calibrated else f', calibrated with {calibrated}'}. "
        f"{_north(recording, first, reference)}"
    )
    return Document(
        title=f"Attitude of {recording.name}",
        lead=lead,
        verdicts=tuple(_verdicts(recording, first)),
        sections=tuple(_sections(solved, reference, findings)),
        numbers=_numbers(recording, solved, findings),
        command=command,
    )


def _north(recording: ImuRecording, first: Solved, reference: Reference | None) -> str:
    """One sentence about what heading counts from."""
    if recording.mag is None:
        return "Without a magnetometer the heading counts from where it began, and drifts."
    if reference is not None and first.error is not None and first.error.offset:
        turned = np.degrees(first.error.offset)
        return (
            f"The truth counts its heading from another direction; the mean offset of {turned:.1f}° is off."
        )
    return "The world is east-north-up; north is magnetic."


def _verdicts(recording: ImuRecording, first: Solved) -> list[Verdict]:
    history = first.history
    found: list[Verdict] = []
    if first.error is not None:
        total, heading, inclination = first.error.degrees
        meaning = f"heading {heading:.2f}°, inclination {inclination:.2f}° over the samples judged"
        found.append(Verdict("error against the truth", total, None, "INFO", meaning, unit="°"))
    if first.share is not None:
        found.append(_honesty(first.share))
    if first.name in {"kalman", "c-kalman", "c-kalman-q"}:
        found += _steepness(float(np.degrees(np.abs(history.roll_pitch_yaw()[:, 1]).max())))
    if (sigmas := history.roll_pitch_yaw_sigmas()) is not None:
        tilt, yaw = np.degrees(np.median(sigmas[:, :2])), np.degrees(np.median(sigmas[:, 2]))
        said = f"median σ of roll and pitch; of yaw {yaw:.2f}°"
        found.append(Verdict("declared uncertainty", float(tilt), None, "INFO", said, unit="°"))
    if history.gyro_bias is not None:
        found.append(_bias(history.gyro_bias[-1]))
    if history.rest is not None:
        share = float(history.rest.mean())
        at_rest = share > 0
        found.append(
            Verdict(
                "time at rest", 100 * share, None, "INFO" if at_rest else "WARN",
                "the gyro's bias is found best there" if at_rest else "the bias was only seen in motion",
                "" if at_rest else "leave the sensor still for two seconds at the start", "%",
            )
        )  # fmt: skip
    if history.magnetic_disturbance is not None and recording.mag is not None:
        found.append(_disturbance(float(history.magnetic_disturbance.mean())))
    micros = 1e6 * first.seconds / len(history)
    found.append(Verdict("time to compute", micros, None, "INFO", "a sample", unit="µs"))
    return found


def _honesty(share: float) -> Verdict:
    """The share of samples inside the 95 % ellipsoid."""
    status: Status = "PASS" if PLAUSIBLE[0] <= share <= PLAUSIBLE[1] else "WARN" if share > 0.5 else "FAIL"
    if status == "PASS":
        return Verdict("errors inside the 95 % ellipsoid", 100 * share, None, status, "σ is honest", unit="%")
    small = share < PLAUSIBLE[0]
    meaning = "the declared covariance is too small" if small else "the declared covariance is too large"
    action = "calibrate the sensors, or declare more noise" if small else "declare less noise"
    return Verdict("errors inside the 95 % ellipsoid", 100 * share, None, status, meaning, action, "%")


def _steepness(pitch: float) -> list[Verdict]:
    """Whether the pitch came near to where a filter of angles loses roll and yaw."""
    if pitch < STEEP:
        return []
    meaning = "roll and yaw exchange their parts near 90°: errors of tens of degrees"
    return [
        Verdict("largest pitch", pitch, None, "WARN", meaning, "use --filter mahony or error-state", unit="°")
    ]


def _bias(bias: Any) -> Verdict:
    """The bias at the end."""
    largest = float(np.degrees(np.abs(bias)).max())
    large = largest > LARGE_BIAS
    axes = ", ".join(f"{name} {np.degrees(value):.3f}" for name, value in zip("xyz", bias, strict=True))
    return Verdict(
        "gyro bias at the end", largest, None, "WARN" if large else "INFO", f"largest axis; {axes} °/s",
        "take it off first: factorlab calibrate gyro" if large else "", "°/s",
    )  # fmt: skip


def _disturbance(share: float) -> Verdict:
    """How long the field was refused."""
    much = share > MUCH
    return Verdict(
        "magnetic field refused", 100 * share, None, "WARN" if much else "INFO",
        "the heading rests on the gyro then" if share else "never",
        "move away from iron, or calibrate: factorlab calibrate mag" if much else "", "%",
    )  # fmt: skip


def _sections(
    solved: tuple[Solved, ...], reference: Reference | None, findings: tuple[Finding, ...]
) -> list[Section]:
    from factorlab.report import attitude_figures as figures

    sections = [
        Section(
            "Roll, pitch and yaw",
            figure=lambda: figures.angles(solved, reference),
            caption="At a pitch of ±90° roll and yaw exchange their parts; the bands widen there.",
        )
    ]
    if reference is not None:
        text = (
            "Root mean square errors over the samples judged (those of motion, where the truth says so). "
            "Inclination is the angle between the verticals, heading the rest."
        )
        sections.append(
            Section("Against the truth", text, _errors(solved), figure=lambda: figures.errors(solved))
        )
    elif len(solved) > 1:
        sections.append(
            Section(
                "Where the estimators differ",
                "Without a truth, what they disagree about is a bound of what can be believed.",
                figure=lambda: figures.spread(solved),
            )
        )
    if any(one.history.gyro_bias is not None for one in solved):
        sections.append(Section("Gyro bias", figure=lambda: figures.biases(solved), caption="Bands are ±2σ."))
    if any(one.history.rest is not None for one in solved):
        sections.append(Section("Rest and disturbance", figure=lambda: figures.moments(solved, reference)))
    if findings:
        rows = tuple((one.severity, one.what, one.where, one.do) for one in findings)
        heads = ("", "found", "where", "what to do")
        sections.append(Section("The recording", table=Table(heads, rows)))
    return sections


def _errors(solved: tuple[Solved, ...]) -> Table:
    """One row an estimator."""
    rows = []
    for one in solved:
        errors = (None, None, None) if one.error is None else one.error.degrees
        share = None if one.share is None else 100 * one.share
        rows.append((one.title, *errors, share, 1e6 * one.seconds / len(one.history)))
    return Table(
        ("estimator", ("total", "°"), ("heading", "°"), ("inclination", "°"), ("inside 95 %", "%"),
         ("time", "µs a sample")),
        tuple(rows),
    )  # fmt: skip


def _numbers(
    recording: ImuRecording, solved: tuple[Solved, ...], findings: tuple[Finding, ...]
) -> dict[str, Any]:
    """Everything under plain names."""
    return {
        "recording": {
            "name": recording.name,
            "samples": len(recording),
            "seconds": recording.duration,
            "rate_hz": recording.rate,
            "magnetometer": recording.mag is not None,
        },
        "filter": solved[0].name,
        "filters": {one.name: _of(one) for one in solved},
        "findings": [
            {"severity": f.severity, "what": f.what, "where": f.where, "do": f.do} for f in findings
        ],
    }


def _of(one: Solved) -> dict[str, Any]:
    history = one.history
    angles = np.degrees(history.roll_pitch_yaw())
    found: dict[str, Any] = {
        "seconds": one.seconds,
        "final_deg": dict(zip(("roll", "pitch", "yaw"), angles[-1].tolist(), strict=True)),
        "final_quaternion_wxyz": history.world_q_body[-1].tolist(),
    }
    if (sigmas := history.roll_pitch_yaw_sigmas()) is not None:
        median = np.degrees(np.median(sigmas, axis=0)).tolist()
        found["median_sigma_deg"] = dict(zip(("roll", "pitch", "yaw"), median, strict=True))
    if history.gyro_bias is not None:
        found["gyro_bias_rad_s"] = history.gyro_bias[-1].tolist()
    for name in ("rest", "magnetic_disturbance"):
        if (flags := getattr(history, name)) is not None:
            found[f"{name}_share"] = float(flags.mean())
    if one.error is not None:
        total, heading, inclination = one.error.degrees
        found["error_deg"] = {
            "total": total, "heading": heading, "inclination": inclination,
            "heading_offset": float(np.degrees(one.error.offset)), "samples": int(one.error.judged.sum()),
        }  # fmt: skip
    if one.nees is not None:
        found["nees"] = {"share_below_95": one.share, "median": float(np.nanmedian(one.nees))}
    return found
