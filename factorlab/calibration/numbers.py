"""The numbers of a calibration as JSON holds them; angles in radians."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from factorlab.calibration.job import Calibrated
from factorlab.calibration.parameters import Parameter
from sequential.sensors import Verification

__all__ = ["numbers_of"]


def numbers_of(done: Calibrated, parameters: tuple[Parameter, ...]) -> dict[str, Any]:
    """Everything that the page draws or tells, under plain names."""
    found: dict[str, Any] = {
        "gravity": done.gravity,
        "parameters": [one.to_json() for one in parameters],
        "calibration": done.calibration.to_dict(),
        "dwells": done.dwells.seconds.tolist(),
    }
    if (a := done.accel) is not None:
        found["accel"] = {
            "leave_one_out_rms": a.leave_one_out_rms,
            "scatter": a.fit.scatter,
            "freedom": a.fit.freedom,
        } | _lists(a, ("before", "after", "left_out", "used"))
    if (g := done.gyro) is not None:
        names = ("seconds", "before", "after", "left_out", "used", "whole")
        found["gyro"] = {"leave_one_out_rms": g.leave_one_out_rms} | _lists(g, names)
    if (t := done.turns) is not None:
        found["turns"] = {"given": [turn.angle for turn in t.turns]} | _lists(t, ("before", "after"))
    if done.verification is not None:
        found["verification"] = _trial(done.verification)
    return found


def _trial(trial: Verification) -> dict[str, Any]:
    moves = [
        {"seconds": list(m.seconds), "by_gyro": m.by_gyro, "by_gravity": m.by_gravity, "off": m.off}
        | _lists(m, ("vector", "rates"))
        for m in trial.moves
    ]
    head = {"name": trial.name, "rms": trial.rms, "moves": moves}
    return head | _lists(trial, ("before", "after", "bias_change"))


def _lists(source: Any, names: Iterable[str]) -> dict[str, Any]:
    values = {name: getattr(source, name) for name in names}
    return {name: None if value is None else value.tolist() for name, value in values.items()}
