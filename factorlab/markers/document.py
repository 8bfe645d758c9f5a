"""What `factorlab markers` says: verdicts, tables, the picture, and the same numbers for a machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from factorlab.markers.export import pose_numbers
from factorlab.markers.job import MarkerReading, MarkersRead
from factorlab.report.document import Document, Section, Status, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["markers_document"]

COURSES_READ = (
    "The likelier pose, with 2σ. Odds: lines are of the track, dots of single frames; both pause where "
    "there is one reading only."
)
SMALL_PX = 20.0
UNLIKELY = 1e-4  # a reading that no table shows; `--json` has it
MISFIT = 4.0  # times the variance of corners that a square may ask for
SURE = 0.95

POSES_READ = (
    "Poses are camera_T_marker: the camera looks along z, x right, y down; the marker's origin is its "
    "centre, x right and y down as printed, z into it. Odds: how many times likelier this reading of "
    "the corners is than its mirror image about the line of sight; — where there is no other. Below 20 "
    "both are worth keeping; both are listed down to one in ten thousand."
)
PICTURE_READ = (
    "Green: one reading only, or odds above 20. Orange: two readings, both drawn, the likelier thick. Red, "
    "green and blue are x, y and the outward normal (−z); the dot is the first corner."
)
TRACKS_READ = (
    "Share: of the frames from first to last sight. Odds rise with motion; single is one frame alone."
)


def markers_document(read: MarkersRead, command: str = "") -> Document:
    """Everything about the markers of a source, for the screen, `--json` and the page."""
    width, height = read.size
    what = f"{read.frames} frames" if read.frames != 1 else "one picture"
    named = f" of dictionary {read.dictionary}" if read.dictionary else ""
    with_poses = read.camera is not None and read.settings.size_m is not None
    side = f", {1e3 * (read.settings.size_m or 0.0):g} mm wide" if with_poses else ""
    numbers = ", ".join(map(str, read.ids))
    many = "Markers" if len(read.ids) > 1 else "Marker"
    who = f"{many} {numbers}{named}{side}" if read.ids else "No marker"
    lead = f"{who} in {what} of {width}x{height}."
    if not with_poses:
        lead += " Give --camera and --size for their poses."
    return Document(
        "Markers", lead, tuple(_verdicts(read)), tuple(_sections(read)), _numbers(read), command=command
    )


def _verdicts(read: MarkersRead) -> list[Verdict]:
    found: list[Verdict] = []
    seen = [one for one in read.readings if one.marker is not None]
    if not seen:
        action = "check the dictionary, that white surrounds each marker, and the light"
        if read.settings.dictionary != "auto":
            action = f"try without --dictionary {read.settings.dictionary}; {action}"
        found.append(Verdict("markers", 0, None, "WARN", "no marker was read", action))
    else:
        means = ", ".join(map(str, read.ids))
        found.append(Verdict("markers", len(read.ids), None, "PASS", f"numbers {means}"))
        found += _sizes(seen)
        found += _poses(seen)
    if read.frames > 1 and seen:
        rate = read.frames / max(read.seconds, 1e-9)
        found.append(
            Verdict("speed", rate, None, "INFO", "detection and poses, without decoding", unit="1/s")
        )
    found += [
        Verdict("left out", None, None, "WARN", sentence, "the rest was read")
        for sentence in read.left_out[:5]
    ]
    if read.fault:
        found.append(Verdict("source", None, None, "WARN", read.fault, "what came before was read"))
    return found


def _sizes(seen: list[MarkerReading]) -> list[Verdict]:
    """How large markers are, and how sure their corners."""
    sides = np.array([one.marker.side_px for one in seen if one.marker is not None])
    sigmas = np.array([one.marker.sigma_px.mean() for one in seen if one.marker is not None])
    small = sides.min() < SMALL_PX
    said = f"median {np.median(sides):.0f} px"
    return [
        Verdict("smallest marker", float(sides.min()), None, "WARN" if small else "INFO", said,
                "come nearer, or print larger" if small else "", "px"),
        Verdict("corners", float(np.median(sigmas)), None, "INFO", "median standard deviation", unit="px"),
    ]  # fmt: skip


def _poses(seen: list[MarkerReading]) -> list[Verdict]:
    """Whether readings are decided, and whether squares fit."""
    poses = [one.pose for one in seen if one.pose is not None]
    if not poses:
        return []
    sure = float(np.mean([pose.certain for pose in poses]))
    status: Status = "PASS" if sure >= SURE else "WARN"
    action = "" if sure >= SURE else "come nearer, tilt the marker, use a board, or let it move (a video)"
    meaning = "poses whose odds against their mirror image exceed 20"
    found = [Verdict("decided", 100.0 * sure, None, status, meaning, action, "%")]
    stretched = float(np.mean([one.alone is not None and one.alone.scale > MISFIT for one in seen]))
    if stretched > 0.2:
        found.append(
            Verdict(
                "corners that fit no square", 100.0 * stretched, None, "WARN",
                "their errors exceed their σ more than twofold, and covariances were raised",
                "check the camera's file and its zoom; a marker must be flat, and seen sharply", "%",
            )
        )  # fmt: skip
    return found


def _sections(read: MarkersRead) -> list[Section]:
    from factorlab.report import marker_figures as figures

    sections: list[Section] = []
    shown = read.in_picture()
    if shown:
        heading = "The picture" if read.frames == 1 else f"The frame with most markers: {_label(read)}"
        sections.append(Section(heading, figure=lambda: _picture(read), caption=PICTURE_READ))
    with_poses = any(one.pose is not None for one in read.readings)
    if shown and not read.moving:
        rows = [one for one in read.readings if one.seen]
        sections.append(_pose_table(rows) if with_poses else _corner_table(rows))
    if read.moving and read.readings:
        sections.append(_track_table(read))
        if with_poses:
            sections.append(
                Section("Distance, tilt and odds", figure=lambda: figures.tracks(read), caption=COURSES_READ)
            )
    return sections


def _picture(read: MarkersRead) -> Figure | None:
    from factorlab.markers.export import overlay
    from factorlab.report import marker_figures as figures

    drawn = overlay(read)
    return None if drawn is None else figures.picture(drawn)


def _label(read: MarkersRead) -> str:
    return read.names[read.shown] if 0 <= read.shown < len(read.names) else ""


def _corner_table(rows: list[MarkerReading]) -> Section:
    table = Table(
        ("picture", "marker", ("side", "px"), ("σ of corners", "px"), ("centre x", "px"), ("centre y", "px")),
        tuple(
            (one.name, str(one.id), one.marker.side_px, float(one.marker.sigma_px.mean()),
             *(round(float(v), 2) for v in one.marker.centre))
            for one in rows if one.marker is not None
        ), digits=5,
    )  # fmt: skip
    return Section("Markers", table=table)


def _pose_table(rows: list[MarkerReading]) -> Section:
    """Both readings of every marker."""
    lines, several = [], len({one.name for one in rows}) > 1
    for one in rows:
        if one.pose is None:
            continue
        for k, mode in enumerate(one.pose.modes):
            if mode.probability < UNLIKELY:
                continue
            sigma = np.sqrt(np.diagonal(mode.cov))
            x, y, z = (1e3 * mode.camera_T_marker[4:]).tolist()
            lines.append(
                (*([one.name if k == 0 else ""] if several else []), str(one.id) if k == 0 else "or", x, y, z,
                 float(1e3 * np.sqrt((sigma[3:] ** 2).sum())), float(np.degrees(mode.tilt_rad)),
                 float(np.degrees(np.sqrt((sigma[:2] ** 2).mean()))), mode.rms_px,
                 _odds(one.pose.odds) if k == 0 else "")
            )  # fmt: skip
    first: tuple[str, ...] = ("picture", "marker") if several else ("marker",)
    headings: tuple[str | tuple[str, str], ...] = (
        *first, ("x", "mm"), ("y", "mm"), ("z", "mm"),
        ("σ of place", "mm"), ("tilt", "°"),
        ("σ of tilt", "°"), ("RMS", "px"), "odds",
    )  # fmt: skip
    return Section("Poses", POSES_READ, Table(headings, tuple(lines)))


def _odds(odds: float) -> str:
    """In words where there is no other reading worth a number."""
    return "—" if not np.isfinite(odds) else "> 10 000" if odds > 1.0 / UNLIKELY else f"{odds:.3g}"


def _track_table(read: MarkersRead) -> Section:
    """One line a marker over a video."""
    lines = []
    for number in read.ids:
        rows = read.of(number)
        seen = [one for one in rows if one.seen]
        span = seen[-1].frame - seen[0].frame + 1
        decided = [one.pose.certain for one in seen if one.pose is not None]
        alone = [one.alone.certain for one in seen if one.alone is not None]
        last = next((one.pose for one in reversed(seen) if one.pose is not None), None)
        lines.append(
            (str(number), seen[0].t_s, seen[-1].t_s, 100.0 * len(seen) / span,
             100.0 * float(np.mean(decided)) if decided else None,
             100.0 * float(np.mean(alone)) if alone else None,
             last.modes[0].distance_m if last is not None else None)
        )  # fmt: skip
    headings = (
        "marker", ("first seen", "s"), ("last seen", "s"), ("share", "%"), ("decided", "%"), ("single", "%"),
        ("last distance", "m"),
    )  # fmt: skip
    return Section("Tracks", TRACKS_READ, Table(headings, tuple(lines)))


def _numbers(read: MarkersRead) -> dict[str, Any]:
    """For a machine: everything of pictures, the last of a video (its frames are in markers.csv)."""
    numbers: dict[str, Any] = {
        "source": read.source,
        "dictionary": read.dictionary,
        "ids": read.ids,
        "frames": read.frames,
        "size": list(read.size),
        "size_m": read.settings.size_m,
        "frames_a_second": read.frames / read.seconds if read.seconds > 0.0 else None,
        "left_out": list(read.left_out),
    }
    last = {one.id: one for one in read.readings if one.seen} if read.moving else None
    chosen = list(last.values()) if last is not None else [one for one in read.readings if one.seen]
    numbers["markers"] = [
        {
            "picture": one.name,
            "t_s": one.t_s,
            "id": one.id,
            "corners_px": one.marker.corners.tolist(),
            "sigma_px": one.marker.sigma_px.tolist(),
            "side_px": one.marker.side_px,
            "pose": pose_numbers(one.pose),
        }
        for one in sorted(chosen, key=lambda one: (one.frame, one.id))
        if one.marker is not None
    ]
    return numbers
