"""What a calibration is worth, in verdicts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factorlab.calibration.job import Calibrated
from factorlab.report.document import Status, Verdict
from sequential.sensors import AccelerometerFit, GyroFit, Move, TurnFit, Verification

__all__ = ["verdicts_of"]

# |mean| - g of a left-out dwell, m/s², and angle by which gravity arrives off: good, and still of use
GOOD_G, FAIR_G = 0.02, 0.1
GOOD_ANGLE, FAIR_ANGLE = np.radians(0.5), np.radians(2.0)
STATUS: dict[str, Status] = {"note": "INFO", "warn": "WARN", "fail": "FAIL"}


def verdicts_of(done: Calibrated) -> tuple[Verdict, ...]:
    """The check on parts left out, what was found on the way, and the trial on another recording."""
    found: list[Verdict] = []
    if done.accel is not None:
        found.append(_dwells(done.accel))
    if done.gyro is not None:
        found.append(_moves(done.gyro))
    if done.turns is not None:
        found.append(_turns(done.turns))
    if done.rest is not None and len(done.dwells) > 1:
        found.append(_rest(done))
    for one in done.findings:
        what = f"{one.what} ({one.where})" if one.where else one.what
        found.append(Verdict("finding", None, None, STATUS[one.severity], what, one.do))
    return (*found, *([] if done.verification is None else _verified(done.verification)))


def _dwells(fit: AccelerometerFit) -> Verdict:
    rms, before = fit.leave_one_out_rms, float(np.sqrt(np.mean(fit.before**2)))
    meaning = (
        f"a position that the fit has not seen reads g to {100 * rms / fit.gravity:.2g} %; "
        f"{before:.3g} m/s² before"
    )
    if fit.fit.freedom < 1 or np.isnan(rms):
        meaning = "as many positions as constants: nothing is left to check them with"
        return Verdict(
            "|mean| − g, RMS", _rms(fit.after), None, "INFO", meaning, "try them with --verify", "m/s²"
        )
    action = "" if rms <= GOOD_G else "hold every position stiller, and add positions"
    status = _judged(rms, GOOD_G, FAIR_G)
    return Verdict("|mean of a left-out dwell| − g, RMS", rms, None, status, meaning, action, "m/s²")


def _moves(fit: GyroFit) -> Verdict:
    angle, chosen = fit.leave_one_out_rms, fit.used & fit.whole
    before = float(np.degrees(np.sqrt(np.mean(fit.before[chosen if chosen.any() else fit.used] ** 2))))
    meaning = f"the gyro turns gravity to where the accelerometer reads it; {before:.2g}° before"
    action = "" if angle <= GOOD_ANGLE else "more moves, slower ones, and longer rests between them"
    status = _judged(angle, GOOD_ANGLE, FAIR_ANGLE)
    degrees = float(np.degrees(angle))
    return Verdict("gravity over a left-out move, RMS", degrees, None, status, meaning, action, "°")


def _turns(fit: TurnFit) -> Verdict:
    known = np.array([turn.angle for turn in fit.turns])
    off, before = (float(np.degrees(np.sqrt(np.mean((a - known) ** 2)))) for a in (fit.after, fit.before))
    meaning = f"what the fitted gains leave of the angles as given; {before:.2g}° before"
    return Verdict("known turns, RMS of the error", off, None, _judged(off, 0.5, 2.0), meaning, "", "°")


def _rest(done: Calibrated) -> Verdict:
    """How far the bias wanders from dwell to dwell."""
    assert done.rest is not None  # noqa: S101 - the caller has looked
    gain = 1.0
    if done.recording.gyro_unit != "rad/s" and done.calibration.gyro is not None:
        gain = float(np.diag(done.calibration.gyro.matrix).mean())
    drift = float(np.degrees(done.rest.drift.max() * gain))
    meaning = "standard deviation from one still part to the next beyond noise; a hand's tremor counts"
    return Verdict("gyro at rest, largest wander", drift, None, "INFO", meaning, "", "°/s")


def _verified(trial: Verification) -> list[Verdict]:
    found: list[Verdict] = []
    if trial.rms is not None:
        before = "" if trial.before is None else f"; {np.sqrt(np.mean(trial.before**2)):.3g} m/s² before"
        meaning = f"{len(trial.dwells)} dwells that the constants were not made from{before}"
        status = _judged(trial.rms, 2 * GOOD_G, FAIR_G)
        found.append(
            Verdict(f"|mean| − g on {trial.name}, RMS", trial.rms, None, status, meaning, "", "m/s²")
        )
    found += [_turned(trial.name, move) for move in trial.moves]
    if trial.bias_change is not None:
        size = float(np.degrees(np.abs(trial.bias_change).max()))
        meaning = "from one switching-on to the next: estimate it anew, as every attitude filter does"
        found.append(Verdict(f"gyro's bias on {trial.name}, change", size, None, "INFO", meaning, "", "°/s"))
    return found


def _turned(name: str, move: Move) -> Verdict:
    meaning = (
        f"between rests gravity turns by {np.degrees(move.by_gyro):.2f}° by the gyro and by "
        f"{np.degrees(move.by_gravity):.2f}° by the accelerometer"
    )
    metric = f"turn at {move.seconds[0]:.0f} s of {name}, gyro against gravity"
    status = _judged(move.off, GOOD_ANGLE, FAIR_ANGLE)
    return Verdict(metric, float(np.degrees(move.off)), None, status, meaning, "", "°")


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _judged(value: float, good: float, fair: float) -> Status:
    return "PASS" if value <= good else "WARN" if value <= fair else "FAIL"
