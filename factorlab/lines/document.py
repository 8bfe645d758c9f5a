"""What `factorlab line` says: verdicts, sections, and the same numbers for a machine."""

from __future__ import annotations

import numpy as np

from factorlab.lines.job import LineRun, Read, has_lane
from factorlab.lines.numbers import run_numbers
from factorlab.report.document import Document, Section, Status, Table, Verdict
from vision3d.lines import LineReading

__all__ = ["line_document"]

SURE = 0.75
MOSTLY, OFTEN = 0.98, 0.8
LOST_S = 0.3  # without a line a robot has left it
FOUND = (
    "Blue: the line's edges. Orange: its middle at the bottom and in the row that looks ahead. "
    "Dashed: straight ahead."
)
LANE = "Green: the lane. Orange: the inner edges of its sides."
NOT_FOUND = "Straight segments; those of one colour aim at one point, grey ones at none."


def line_document(run: LineRun, command: str = "") -> Document:
    """Tell what was read of a picture, or of the frames of a video."""
    width, height = run.size
    many = "one picture" if run.is_picture else f"{len(run.reads)} frames, {run.fps:.3g} a second"
    where = "in metres on the ground" if run.ground is not None else "in pixels: the ground is not known"
    lead = f"{many} of {width} by {height} px; {where}."
    verdicts = _picture_verdicts(run) if run.is_picture else _video_verdicts(run)
    return Document(
        title=f"Line in {run.source}",
        lead=lead,
        verdicts=tuple(verdicts),
        sections=tuple(_sections(run)),
        numbers=run_numbers(run),
        command=command,
        conclusion=_conclusion(run),
    )


def _conclusion(run: LineRun) -> str:
    """The answer in one sentence."""
    if not run.is_picture:
        what = "line or a lane" if run.job.lane else "line"
        return f"A {what} was seen in {100 * run.found.mean():.0f} % of {len(run.reads)} frames."
    read = run.reads[0]
    if read.lane is not None and has_lane(read) and not read.line.found:
        lane_side = "right" if read.lane.offset > 0 else "left"
        aside = f"its middle {100 * abs(read.lane.offset):.0f} % of its width to the {lane_side}"
        return f"A lane, {aside}, running {_leaning(read.lane.heading_rad)} in the image."
    if read.line.found:
        side = "right" if read.line.offset > 0 else "left"
        shade, share = "dark" if read.line.dark else "light", abs(100 * read.line.offset)
        where = f"{share:.0f} % to the {side}"
        if read.metres is not None:
            where = f"{100 * abs(read.metres.offset_m):.1f} cm to the {side}"
        return f"A {shade} line, {where}, running {_leaning(read.line.heading_rad)} in the image."
    told = f"; the picture shows {run.scene.words}" if run.scene is not None else ""
    return f"There is no line on the ground to follow{told}."


def _leaning(angle_rad: float) -> str:
    """Degrees to one side."""
    degrees = float(np.degrees(angle_rad))
    return (
        "straight ahead"
        if abs(degrees) < 0.5
        else f"{abs(degrees):.1f}° to the {'right' if degrees > 0 else 'left'}"
    )


def _picture_verdicts(run: LineRun) -> list[Verdict]:
    read = run.reads[0]
    if has_lane(read) and not read.line.found:
        return [_lane_verdict(read)]
    verdicts = [_line_verdict(read.line)]
    if read.line.found:
        verdicts += _line_numbers(read)
    elif run.scene is not None:
        verdicts.append(
            Verdict("straight lines", float(len(run.scene.segments)), None, "INFO", run.scene.words)
        )
    if read.lane is not None:
        verdicts.append(_lane_verdict(read))
    return verdicts


def _line_verdict(line: LineReading) -> Verdict:
    if not line.found:
        return Verdict(
            "line on the ground", line.confidence, (0.5, 1.0), "FAIL", f"none: {line.reason}",
            "look for two sides with --lane" if "other stripe" in line.reason else
            "point the camera at the ground; or say what the line is like: --polarity, --width, --contrast",
        )  # fmt: skip
    status: Status = "PASS" if line.confidence >= SURE else "WARN"
    meaning = "clearly the only stripe" if not line.reason else line.reason
    action = "" if status == "PASS" else "look at line.png: is it the right one?"
    return Verdict("line on the ground", line.confidence, (0.5, 1.0), status, meaning, action)


def _line_numbers(read: Read) -> list[Verdict]:
    line = read.line
    sigma = np.sqrt(np.diag(line.cov_px))
    found = [
        Verdict(
            "offset at the bottom", line.offset, None, "INFO", "of half the image's width, right is positive"
        ),
        Verdict(
            "heading in the image", float(np.degrees(line.heading_rad)), None, "INFO",
            "from straight up, right is positive", unit="°",
        ),
        Verdict(
            "σ of the line's middle", float(sigma[1]), None, "INFO",
            f"in the row that looks ahead; {sigma[0]:.2f} px at the bottom", unit="px",
        ),
    ]  # fmt: skip
    if read.metres is not None:
        spread = np.sqrt(np.diag(read.metres.cov))
        offset, heading = read.metres.offset_m, float(np.degrees(read.metres.heading_rad))
        half, turn = 1.96 * float(spread[0]), 1.96 * float(np.degrees(spread[1]))
        found += [
            Verdict(
                "offset on the ground", offset, (offset - half, offset + half), "INFO",
                f"{read.metres.near[0]:.2f} m ahead, left is positive", unit="m",
            ),
            Verdict(
                "heading on the ground", heading, (heading - turn, heading + turn), "INFO",
                f"over {read.metres.far[0] - read.metres.near[0]:.2f} m, left is positive", unit="°",
            ),
        ]  # fmt: skip
    return found


def _lane_verdict(read: Read) -> Verdict:
    lane = read.lane
    assert lane is not None  # noqa: S101 - the caller has looked
    if not lane.found:
        return Verdict("lane", None, None, "WARN", f"none: {lane.reason}")
    return Verdict(
        "lane", lane.offset, None, "PASS",
        f"its middle, in lane widths, right is positive; it runs {_leaning(lane.heading_rad)}",
    )  # fmt: skip


def _video_verdicts(run: LineRun) -> list[Verdict]:
    found = run.found
    share = float(found.mean())
    status: Status = "PASS" if share >= MOSTLY else "WARN" if share >= OFTEN else "FAIL"
    verdicts = [
        Verdict(
            "frames with a line or lane" if run.job.lane else "frames with a line",
            100 * share, (100 * MOSTLY, 100.0), status,
            "seen all the way" if status == "PASS" else _why_lost(run),
            "" if status == "PASS" else "look at the frames without it in frames.csv", "%",
        )
    ]  # fmt: skip
    longest, begin = _longest_gap(run)
    if longest > 0:
        verdicts.append(
            Verdict(
                "longest time without it", longest, (0.0, LOST_S), "PASS" if longest <= LOST_S else "FAIL",
                f"from t = {begin:.2f} s",
                "slow down there, or let the camera look nearer" if longest > LOST_S else "", "s",
            )
        )  # fmt: skip
    if any(one.line.found for one in run.reads):
        metric = [one.metres.offset_m for one in run.reads if one.metres is not None]
        offsets = np.array(metric or [one.line.offset for one in run.reads if one.line.found])
        verdicts.append(
            Verdict(
                "offset on the ground" if metric else "offset at the bottom",
                float(np.sqrt(np.mean(offsets**2))), None, "INFO",
                f"RMS{'' if metric else ', of half the width'}; largest {np.abs(offsets).max():.2g}",
                unit="m" if metric else "",
            )
        )  # fmt: skip
    millis = float(np.median([one.millis for one in run.reads]))
    verdicts.append(Verdict("time to read a frame", millis, None, "INFO", "median", unit="ms"))
    if run.fault:
        verdicts.append(
            Verdict("source", run.source, None, "WARN", run.fault, "what came before is all here")
        )
    return verdicts


def _why_lost(run: LineRun) -> str:
    """The reason most frames without a line give."""
    reasons = [one.line.reason for one, seen in zip(run.reads, run.found, strict=True) if not seen]
    return max(set(reasons), key=reasons.count)


def _longest_gap(run: LineRun) -> tuple[float, float]:
    """How long (s) no line was seen at most, and from when on."""
    longest, begin, since = 0.0, 0.0, None
    for one, seen in zip(run.reads, run.found, strict=True):
        if seen:
            since = None
            continue
        since = one.t_s if since is None else since
        lasting = one.t_s - since + 1.0 / run.fps
        if lasting > longest:
            longest, begin = lasting, since
    return longest, begin


def _sections(run: LineRun) -> list[Section]:
    from factorlab.report import line_figures as figures

    sections = []
    if run.is_picture:
        sections.append(
            Section(
                "The picture",
                figure=lambda: figures.picture(run),
                caption=_caption(run.reads[0]),
            )
        )
        if run.reads[0].line.parts and (run.reads[0].line.found or not has_lane(run.reads[0])):
            sections.append(_parts_section(run.reads[0].line))
    else:
        sections.append(
            Section(
                "Offset and heading", figure=lambda: figures.over_time(run),
                caption="Gaps in the curves are frames without a line; bands are ±2σ.",
            )
        )  # fmt: skip
        sections.append(Section("Some frames", figure=lambda: figures.frames(run)))
    if run.left_out:
        sections.append(Section("Left out", table=Table(("frame",), tuple((one,) for one in run.left_out))))
    return sections


def _caption(read: Read) -> str:
    """How the picture is read."""
    if read.line.found:
        return FOUND
    return LANE if has_lane(read) else NOT_FOUND


MEANINGS = {
    "reach": "share of the rows from bottom to middle that show it",
    "contrast": "difference from the ground on the side where it is smaller",
    "even width": "its width changes evenly from row to row",
    "smooth": "its middle runs along a smooth curve",
    "clear ground": "share of all strong edges that are its own",
    "alone": "nothing else looks as much like a line",
}


def _parts_section(line: LineReading) -> Section:
    rows = tuple((name, value, MEANINGS[name]) for name, value in line.parts.items())
    return Section(
        "Confidence",
        "Each part is 0 to 1; the confidence is their product.",
        Table(("part", "value", "what it asks"), rows),
        page_only=True,
    )
