"""Where the six positions and three turns of a Ferraris session lie in its recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from sequential.sensors.recording import ImuRecording
from sequential.sensors.still import StillDetector

__all__ = ["POSITIONS", "SECTIONS", "TURNS", "Rows", "find_sections", "require_sections"]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
POSITIONS = ("x_p", "x_a", "y_p", "y_a", "z_p", "z_a")  # the axis that points up, or down
TURNS = ("x_rot", "y_rot", "z_rot")
SECTIONS = (*POSITIONS, *TURNS)
NEAR = np.cos(np.radians(30.0))
SAME_POSITION = np.cos(np.radians(15.0))
ABOUT_ONE_AXIS = 0.9  # share of a turn that is about its own axis
SMOOTH_S, AT_REST = 0.25, 0.08  # window, and share of the highest rate that is no motion
MARGIN_S = 0.3  # still samples taken with a turn on either side


def require_sections(given: Mapping[str, ArrayLike | slice], recording: ImuRecording) -> dict[str, Rows]:
    """Rows of all nine sections.

    Raises
    ------
    DataError
        where a section is missing, unknown, too short or outside of the recording.
    """
    if missing := [name for name in SECTIONS if name not in given]:
        raise DataError(
            f"a Ferraris session needs the sections {', '.join(SECTIONS)}; missing: {', '.join(missing)}"
        )
    if unknown := [name for name in given if name not in SECTIONS]:
        raise DataError(f"unknown section {', '.join(map(repr, unknown))}; known are {', '.join(SECTIONS)}")
    every = np.arange(len(recording))
    found = {}
    for name in SECTIONS:
        part = given[name]
        rows = every[part] if isinstance(part, slice) else np.asarray(part, dtype=np.int64).ravel()
        if len(rows) < 3:
            raise DataError(f"section {name} has {len(rows)} samples; it needs three at least")
        if rows.min() < 0 or rows.max() >= len(recording):
            raise DataError(f"section {name} asks for rows {rows.min()} to {rows.max()} of {len(recording)}")
        found[name] = rows
    return found


def find_sections(
    recording: ImuRecording, turn: float = 2 * np.pi, detector: StillDetector | None = None
) -> dict[str, Rows]:
    """Find the sections: the longest dwell of each position, and the largest turn between two like dwells.

    Parameters
    ----------
    turn : size of the turns, rad; where the gyro is in rad/s, a turn must come within 30 % of it

    Raises
    ------
    DataError
        naming positions and turns that are not there.
    """
    recording.require("accel", "gyro", si=False)
    assert recording.accel is not None  # noqa: S101 - require() has looked
    assert recording.gyro is not None  # noqa: S101
    # the gyro alone sees a turn about the vertical: stillness is looked for in both
    dwells = _still_in_both(recording, detector or StillDetector())
    if len(dwells) < 6:
        raise DataError(
            f"recording {recording.name!r} holds {len(dwells)} still parts; a Ferraris session has six "
            "positions of some seconds each, and still parts around its three turns"
        )
    means = np.array([recording.accel[rows].mean(axis=0) for rows in dwells])
    middle = (means.min(axis=0) + means.max(axis=0)) / 2
    half = np.maximum((means.max(axis=0) - means.min(axis=0)) / 2, 1e-12)
    up = (means - middle) / half
    up /= np.linalg.norm(up, axis=1)[:, None]
    found = _positions(dwells, up, recording.name)
    found |= _turns(recording, dwells, up, turn)
    return {name: found[name] for name in SECTIONS}


def _still_in_both(recording: ImuRecording, detector: StillDetector) -> list[Rows]:
    """Runs of rows that are in a dwell of the accelerometer and in one of the gyro, which is slow there."""
    masks = []
    for alone in (replace(recording, gyro=None), replace(recording, accel=None)):
        mask = np.zeros(len(recording), dtype=bool)
        for rows in detector.find(alone):
            mask[rows] = True
        masks.append(mask)
    # on a turntable a steady turn is as quiet as rest
    assert recording.gyro is not None  # noqa: S101 - find_sections() has looked
    mean = window_mean(recording.gyro, max(1, round(SMOOTH_S * recording.rate)))
    quiet = masks[0] & masks[1]
    bias = np.median(recording.gyro[quiet], axis=0) if quiet.any() else 0.0
    speed = np.linalg.norm(mean - bias, axis=1)
    quiet &= speed < AT_REST * np.quantile(speed, 0.999)
    edges = np.diff(quiet.astype(np.int8), prepend=0, append=0)
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    fewest = max(3, round(0.5 * detector.shortest * recording.rate))
    return [np.arange(a, b) for a, b in zip(starts, stops, strict=True) if b - a >= fewest]


def window_mean(values: Array, count: int) -> Array:
    """Mean (N, 3) of a window of `count` samples centred on each, shorter at the ends."""
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    k = np.arange(len(values))
    low, high = np.maximum(k - count // 2, 0), np.minimum(k + (count + 1) // 2, len(values))
    return np.asarray((total[high] - total[low]) / (high - low)[:, None])


def _positions(dwells: list[Rows], up: Array, name: str) -> dict[str, Rows]:
    found, missing = {}, []
    for k, section in enumerate(POSITIONS):
        along = up[:, k // 2] * (1 if k % 2 == 0 else -1)
        like = [rows for rows, one in zip(dwells, along, strict=True) if one > NEAR]
        if like:
            found[section] = max(like, key=len)
        else:
            missing.append(f"{section} ({section[0]} axis {'up' if section.endswith('p') else 'down'})")
    if missing:
        raise DataError(
            f"recording {name!r}: no still part for {', '.join(missing)}; record it, or name the sections"
        )
    return found


def _turns(recording: ImuRecording, dwells: list[Rows], up: Array, turn: float) -> dict[str, Rows]:
    gyro = recording.gyro
    assert gyro is not None  # noqa: S101 - find_sections() has looked
    bias = np.median(np.concatenate([gyro[rows] for rows in dwells]), axis=0)
    step = np.gradient(recording.seconds)
    margin = round(MARGIN_S * recording.rate)
    best: dict[str, tuple[float, Rows]] = {}
    for k, (before, after) in enumerate(pairwise(dwells)):
        rows = np.arange(max(before[0], before[-1] - margin), min(after[-1], after[0] + margin) + 1)
        angle = step[rows] @ (gyro[rows] - bias)
        axis = int(np.argmax(np.abs(angle)))
        size = float(abs(angle[axis]))
        if up[k] @ up[k + 1] < SAME_POSITION or abs(up[k, axis]) < NEAR:
            continue
        if size < ABOUT_ONE_AXIS * float(np.linalg.norm(angle)):
            continue
        if recording.gyro_unit == "rad/s" and not 0.7 * turn < size < 1.3 * turn:
            continue
        if size > best.get(TURNS[axis], (0.0, rows))[0]:
            best[TURNS[axis]] = (size, rows)
    if missing := [name for name in TURNS if name not in best]:
        raise DataError(
            f"recording {recording.name!r}: no turn found for {', '.join(missing)}; a turn is made in one go "
            f"about the upward axis, by {np.degrees(turn):.0f}°, with a second of rest before and after"
        )
    return {name: rows for name, (_, rows) in best.items()}
