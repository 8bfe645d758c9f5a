"""What a session tells: the page's state, many times a second, and the summary at the end."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from factorlab.live.plain import plain

if TYPE_CHECKING:
    from factorlab.live.camera.session import CameraSession, Shown

__all__ = ["state_of", "summary_of"]


def state_of(session: CameraSession) -> dict[str, Any]:
    """What the page shows besides the picture, as strict JSON takes it."""
    source, recording, task = session.reader.source, session.recording, session.task
    newest = session.shown.take(0, 0.0)
    shown = newest[1] if newest else None
    return {
        "source": {
            **{key: getattr(source, key) for key in ("name", "fps", "live", "count")},
            "size": list(source.size),
            "left_out": list(source.left_out),
        },
        "task": task.name,
        "tasks": [{"name": choice.name, "title": choice.title} for choice in session.choices.values()],
        "actions": [{"name": name, "title": title} for name, title in task.actions],
        "paused": session.reader.paused,
        "ended": session.ended,
        "fault": source.fault or (session.faults[-1] if session.faults else ""),
        "overlay": session.overlay,
        "message": session.message,
        "recording": recording and {"folder": str(recording.folder), "seconds": recording.seconds},
        "recorded": [recorded.to_json() for recorded in session.recorded],
        "rates": plain(vars(session.rates.now(time.monotonic_ns()))),
        "frame": None if shown is None else _frame(shown),
        "reading": None if shown is None or shown.task != task.name else shown.reading.to_json(),
    }


def summary_of(session: CameraSession) -> dict[str, Any]:
    """What the session amounts to."""
    source = session.reader.source
    return {
        "schema": 1,
        "source": source.name,
        "size": list(source.size),
        "frames": session.reader.count,
        "worked_on": session.rates.frames,
        "skipped": session.rates.skipped,
        "fault": source.fault,
        "left_out": list(source.left_out),
        "recordings": [recorded.to_json() for recorded in session.recorded],
        "tasks": plain({name: task.summary() for name, task in session.tasks.items()}),
    }


def _frame(shown: Shown) -> dict[str, Any]:
    frame = shown.captured.frame
    unix_ms = time.time() * 1e3 - (time.monotonic_ns() - shown.captured.captured_ns) * 1e-6
    return {"index": frame.index, "t_s": frame.t_ns * 1e-9, "name": frame.name, "captured_ms": unix_ms}
