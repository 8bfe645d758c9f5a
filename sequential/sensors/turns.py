"""Gyro gain from turns of known angle, one axis at a time: against the edge of a table, or on a turntable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, UnderConstrainedError
from sequential.manifold.quaternion import quaternion_log
from sequential.sensors.calibration import AffineCalibration
from sequential.sensors.dwells import Dwells
from sequential.sensors.gyro_integral import GyroIntervals, intervals_between, turned
from sequential.sensors.gyro_rest import GyroAtRest, bias_at_rest
from sequential.sensors.prior_fit import Fitted, Scatter, Unknowns, fit_with_scatter
from sequential.sensors.recording import ImuRecording

__all__ = ["KnownTurn", "TurnFit", "moves_between", "turn_gains"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class KnownTurn:
    """One turn about an axis of the sensor, 0, 1 or 2, by an angle in rad, positive by the right hand."""

    axis: int
    angle: float

    @classmethod
    def parse(cls, text: str) -> KnownTurn:
        """From `x=90` or `z=-360`, degrees.

        Raises
        ------
        DataError
        """
        name, _, degrees = text.replace(":", "=").partition("=")
        try:
            angle = np.radians(float(degrees))
        except ValueError:
            angle = 0.0
        if name.strip() not in {"x", "y", "z"} or not np.isfinite(angle) or angle == 0:
            raise DataError(f"{text!r} is no turn; write the axis and the degrees, as x=90 or z=-360")
        return cls("xyz".index(name.strip()), float(angle))


@dataclass(frozen=True, slots=True, eq=False)
class TurnFit:
    """Gains from known turns; angles (T,) rad, signed about the turn's axis."""

    calibration: AffineCalibration
    fit: Fitted
    rest: GyroAtRest
    turns: tuple[KnownTurn, ...]
    seconds: Array
    before: Array
    after: Array


def moves_between(recording: ImuRecording, dwells: Dwells) -> GyroIntervals:
    """Readings of every move, from the end of a dwell to the beginning of the next."""
    same = np.flatnonzero(dwells.part[:-1] == dwells.part[1:])
    if not len(same):
        raise DataError(f"{recording.name!r} holds no move between two still parts: rest before and after it")
    return intervals_between(recording, dwells.stop[same], dwells.start[same + 1])


def turn_gains(
    recording: ImuRecording,
    dwells: Dwells,
    turns: Sequence[KnownTurn],
    *,
    sigma: float = np.radians(0.5),
    prior: float = 0.1,
) -> TurnFit:
    """Gain of every axis that is turned about; the others keep the nominal one.

    The angle is that of the whole rotation, full turns counted, so the axis need not be held exactly.

    Parameters
    ----------
    turns : one for every move between two still parts, in order
    sigma : how exactly the angles are known, rad
    prior : standard deviation of a gain beforehand, relative

    Raises
    ------
    DataError, UnderConstrainedError
        where moves and turns do not match in number or sign.
    """
    moves, rest = moves_between(recording, dwells), bias_at_rest(dwells)
    if len(moves.dt) != len(turns):
        raise UnderConstrainedError(
            f"{recording.name!r} holds {len(moves.dt)} moves between still parts, {len(turns)} turns are "
            "given: name each move once, in order, and rest for a second in between"
        )
    axes = np.array([turn.axis for turn in turns])
    known = np.array([turn.angle for turn in turns])
    summed = np.einsum("sli,sl->si", moves.raw - rest.bias, moves.dt)[np.arange(len(turns)), axes]
    _require_signs(recording.name, summed, known)
    gain = 1.0 if recording.gyro_unit == "rad/s" else float(np.median(known / summed))

    def model(x: Array) -> tuple[Array, Array]:
        angle, slope = _angles(np.diag(x[:3]) * gain, x[3:] / gain, moves, known)
        return angle - known, np.hstack([slope[:, [0, 4, 8]] * gain, slope[:, 9:] / gain])

    bias_sigma = np.sqrt(np.diag(rest.cov)) * gain + 1e-7
    unknowns = Unknowns(np.r_[np.ones(3), rest.bias * gain], np.r_[np.full(3, prior), bias_sigma])
    noise = np.full(len(turns), sigma**2)
    fit = fit_with_scatter(model, lambda _: noise, unknowns, Scatter(sigma / 3))
    matrix, offset = np.diag(fit.parameters[:3]) * gain, fit.parameters[3:] / gain
    place = np.array([0, 4, 8, 9, 10, 11])
    scale = np.r_[np.full(3, gain), np.full(3, 1 / gain)]
    cov = np.zeros((12, 12))
    cov[np.ix_(place, place)] = fit.cov * np.outer(scale, scale)
    rms = float(np.sqrt(np.mean(fit.residual**2)))
    source = f"{recording.name}: {len(turns)} known turns"
    same = np.flatnonzero(dwells.part[:-1] == dwells.part[1:])
    return TurnFit(
        AffineCalibration(matrix, offset, cov, "gyro", recording.gyro_unit, "rad/s", rms, source),
        fit,
        rest,
        tuple(turns),
        np.stack([dwells.seconds[same, 1], dwells.seconds[same + 1, 0]], axis=1),
        _angles(np.eye(3) * gain, rest.bias, moves, known)[0],
        _angles(matrix, offset, moves, known)[0],
    )


def _angles(matrix: Array, offset: Array, moves: GyroIntervals, known: Array) -> tuple[Array, Array]:
    """Signed angle (T,) of each move on the branch nearest the known one, and its derivative (T, 12)."""
    turn = turned(matrix, offset, moves)
    vector = quaternion_log(turn.quaternion)
    short = np.linalg.norm(vector, axis=1)
    axis = vector / np.maximum(short, 1e-12)[:, None]
    whole = 2 * np.pi
    target = np.abs(known)
    up = short + whole * np.round((target - short) / whole)
    down = -short + whole * np.round((target + short) / whole)
    rising = np.abs(up - target) <= np.abs(down - target)
    sign = np.where(rising, 1.0, -1.0) * np.sign(known)
    by = np.concatenate([turn.by_matrix, turn.by_offset], axis=2)
    slope = np.einsum("si,sij->sj", axis, by) * sign[:, None]
    return np.where(rising, up, down) * np.sign(known), slope


def _require_signs(name: str, summed: Array, known: Array) -> None:
    for k, (rate, angle) in enumerate(zip(summed, known, strict=True)):
        if rate * angle <= 0:
            raise DataError(
                f"turn {k + 1} of {name!r} is given as {np.degrees(angle):+g}°, the gyro turned the other "
                "way: check order and sign (right hand: thumb along the axis)"
            )
