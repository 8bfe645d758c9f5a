"""What a drive tells: the page's state, many times a second, and the summary at the end."""

from __future__ import annotations

import base64
from dataclasses import asdict
from typing import Any

import numpy as np

from factorlab.l19.follower import CURVES, FollowerSettings, Step
from factorlab.l19.follower.eye import BOTTOM, MIDDLE
from factorlab.live.follower.controls import CONTROLS, DETECTORS
from factorlab.live.follower.journey import SHOWN, Journey
from factorlab.live.follower.session import PACES, FollowerSession
from factorlab.live.plain import plain

__all__ = ["Cursor", "line_of", "setup_of", "state_of", "summary_of"]

MOST_ROWS = 2000  # of a drive in one message


def setup_of() -> dict[str, Any]:
    """What does not change: sliders, curves, the meaning of the rows."""
    return {
        "controls": [control.to_json() for control in CONTROLS],
        "curves": dict(CURVES),
        "detectors": DETECTORS,
        "paces": list(PACES),
        "columns": list(SHOWN),
        "defaults": asdict(FollowerSettings()),
    }


def line_of(session: FollowerSession) -> dict[str, Any]:
    """The points of the line, m."""
    return {"number": session.lines, "points": session.line.round(4).tolist()}


def state_of(session: FollowerSession) -> dict[str, Any]:
    """What the page shows besides the way that was driven."""
    journey, step = session.journey, session.last
    return {
        "journey": journey.to_json(),
        "before": [one.to_json() for one in session.journeys[:-1]],
        "line": session.lines,
        "settings": asdict(session.settings),
        "paused": session.paused,
        "ended": session.ended.is_set(),
        "pace": session.pace,
        "steps": session.steps,
        "fault": session.fault,
        "own": session.own.name if session.own is not None else "",
        "step": None if step is None else _step(step) | {"unseen_s": journey.unseen_s},
    }


class Cursor:
    """How far one page has been told of the way."""

    def __init__(self) -> None:
        self.number, self.rows = 0, 0

    def news(self, session: FollowerSession) -> dict[str, Any]:
        """The state, with the steps since the last call; `begin` is the place of the first of them."""
        state = state_of(session)
        journey = session.journey
        if journey.number != self.number:
            self.number, self.rows = journey.number, 0
        begin, end = self.rows, min(len(journey.rows), self.rows + MOST_ROWS)
        self.rows = end
        return state | {"way": {"number": journey.number, "begin": begin, "rows": journey.shown(begin, end)}}


def summary_of(session: FollowerSession) -> dict[str, Any]:
    """What the drives amount to; the last one is the one that is written."""
    driven = session.driven
    return {
        "settings": asdict(session.settings),
        "fault": session.fault,
        "journey": _whole(driven[-1]) if driven else None,
        "journeys": [one.to_json() for one in driven],
    }


def _whole(journey: Journey) -> dict[str, Any]:
    """One drive in full: how far from the line, from its estimate, and from its odometry."""
    table = journey.table()
    apart = {
        name: np.hypot(table["x_m"] - table[f"x_{key}_m"], table["y_m"] - table[f"y_{key}_m"])
        for name, key in (("estimate", "est"), ("odometry", "odo"))
    }
    return journey.to_json() | {
        "worst_m": float(np.abs(table["offset_m"]).max()),
        "length_m": journey.length_m,
        "estimate_rms_m": float(np.sqrt(np.mean(apart["estimate"] ** 2))),
        "odometry_rms_m": float(np.sqrt(np.mean(apart["odometry"] ** 2))),
        "found_share": float(table["found"].mean()),
        "lost_share": float(table["lost"].mean()),
    }


def _step(step: Step) -> dict[str, Any]:
    """The newest step; the image as the bytes of its grey levels, row by row."""
    reading = step.reading
    height, width = step.image.shape
    return {
        "t_s": float(step.t_s),
        "image": base64.b64encode(step.image.tobytes()).decode(),
        "size": [width, height],
        "rows": [BOTTOM, MIDDLE],
        "pose": [round(float(one), 5) for one in step.pose],
        "estimate": [round(float(one), 5) for one in step.estimate],
        "cov": _in_world(step),
        "offset_m": float(step.offset_m),
        "v_m_s": float(step.command[0]),
        "w_rad_s": float(step.command[1]),
        "lost": bool(step.lost),
        **plain(
            {
                name: getattr(reading, name)
                for name in ("found", "used", "bottom_px", "middle_px", "confidence", "reason")
            }
        ),
    }


def _in_world(step: Step) -> list[float]:
    """Covariance of x and y in the world as xx, xy, yy, m²; a step has it in the robot's axes."""
    c, s = np.cos(step.estimate[2]), np.sin(step.estimate[2])
    turn = np.array([[c, -s], [s, c]])
    cov = turn @ step.cov[:2, :2] @ turn.T
    return [float(cov[0, 0]), float(cov[0, 1]), float(cov[1, 1])]
