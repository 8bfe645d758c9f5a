"""What was read of a line, under plain names for a machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.lines.job import LineRun, Read
from vision3d.lines import GroundReading, Lane, LineReading, Scene

__all__ = ["COLUMNS", "row_of", "run_numbers"]

COLUMNS = (
    "t_s", "name", "found", "confidence", "offset", "heading_deg", "bottom_x_px", "middle_x_px",
    "sigma_bottom_px", "sigma_middle_px", "width_px", "offset_m", "sigma_offset_m", "heading_ground_deg",
    "sigma_heading_ground_deg", "reason",
)  # fmt: skip
MOST_SEGMENTS = 200


def run_numbers(run: LineRun) -> dict[str, Any]:
    """Keys of report.json."""
    told: dict[str, Any] = {
        "source": {"name": run.source, "size": list(run.size), "frames": len(run.reads)},
        "ground_known": run.ground is not None,
    }
    if run.ground is not None:
        told["ground_H_image"] = run.ground.ground_H_image.tolist()
    if run.is_picture:
        read = run.reads[0]
        told["line"] = line_numbers(read.line) | ground_numbers(read.metres)
        if run.scene is not None:
            told["scene"] = scene_numbers(run.scene)
        if read.lane is not None:
            told["lane"] = lane_numbers(read.lane)
    else:
        told["share_found"] = float(run.found.mean())
        told["median_ms"] = float(np.median([one.millis for one in run.reads]))
        told["frames"] = [row_of(one) for one in run.reads]
    if run.left_out:
        told["left_out"] = list(run.left_out)
    if run.fault:
        told["fault"] = run.fault
    return told


def line_numbers(line: LineReading) -> dict[str, Any]:
    """A reading in pixels."""
    told: dict[str, Any] = {
        "found": line.found,
        "confidence": line.confidence,
        "reason": line.reason,
        "parts": dict(line.parts),
    }
    if line.found:
        told |= {
            "offset": line.offset,
            "heading_deg": float(np.degrees(line.heading_rad)),
            "bottom_px": list(line.bottom_px),
            "middle_px": list(line.middle_px),
            "cov_px2": line.cov_px.tolist(),
            "width_px": line.width_px,
            "dark": line.dark,
        }
    return told


def ground_numbers(metres: GroundReading | None) -> dict[str, Any]:
    """A reading in metres."""
    if metres is None:
        return {}
    sigma = np.sqrt(np.diag(metres.cov))
    return {
        "ground": {
            "near_m": metres.near.tolist(),
            "far_m": metres.far.tolist(),
            "offset_m": metres.offset_m,
            "sigma_offset_m": float(sigma[0]),
            "heading_deg": float(np.degrees(metres.heading_rad)),
            "sigma_heading_deg": float(np.degrees(sigma[1])),
        }
    }


def scene_numbers(scene: Scene) -> dict[str, Any]:
    """Segments and vanishing points."""
    return {
        "segments": len(scene.segments),
        "longest_px": np.round(scene.segments[:MOST_SEGMENTS], 2).tolist(),
        "built": scene.built,
        "vanishing_points": [
            {
                "kind": point.kind,
                "pixel": None if point.pixel is None else list(point.pixel),
                "angle_deg": float(np.degrees(point.angle_rad)),
                "segments": len(point.members),
                "share": point.share,
            }
            for point in scene.points
        ],
        "words": scene.words,
    }


def lane_numbers(lane: Lane) -> dict[str, Any]:
    """The two sides of a lane."""
    if not lane.found:
        return {"found": False, "reason": lane.reason}
    return {
        "found": True,
        "left_px": lane.left.tolist(),
        "right_px": lane.right.tolist(),
        "meeting_px": lane.meeting_px.tolist(),
        "offset": lane.offset,
        "heading_deg": float(np.degrees(lane.heading_rad)),
    }


def row_of(read: Read) -> dict[str, Any]:
    """One frame, cells by `COLUMNS`; None where there is nothing."""
    line, metres = read.line, read.metres
    row: dict[str, Any] = dict.fromkeys(COLUMNS)
    row |= {
        "t_s": round(read.t_s, 6),
        "name": read.name,
        "found": line.found,
        "confidence": line.confidence,
        "reason": line.reason,
    }
    if line.found:
        sigma = np.sqrt(np.diag(line.cov_px))
        row |= {
            "offset": line.offset,
            "heading_deg": float(np.degrees(line.heading_rad)),
            "bottom_x_px": line.bottom_px[0],
            "middle_x_px": line.middle_px[0],
            "sigma_bottom_px": float(sigma[0]),
            "sigma_middle_px": float(sigma[1]),
            "width_px": line.width_px,
        }
    if metres is not None:
        spread = np.sqrt(np.diag(metres.cov))
        row |= {
            "offset_m": metres.offset_m,
            "sigma_offset_m": float(spread[0]),
            "heading_ground_deg": float(np.degrees(metres.heading_rad)),
            "sigma_heading_ground_deg": float(np.degrees(spread[1])),
        }
    return row
