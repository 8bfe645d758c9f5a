"""Gyro calibration between dwells: gravity, carried over each move by the gyro, must arrive where it is.

The idea of Tedaldi et al. (ICRA 2014, section III-B).  Here directions come from the ends of the dwells next
to the move (a hand drifts during a dwell), the bias is fitted along with its estimate at rest as prior, the
gyro's reading of gravity itself is taken off where the dwells show one, and the parameters have a covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, UnderConstrainedError
from sequential.sensors.calibration import AffineCalibration
from sequential.sensors.dwells import Dwells
from sequential.sensors.finding import Finding
from sequential.sensors.gyro_case import GyroCase
from sequential.sensors.gyro_rest import GyroAtRest, bias_at_rest
from sequential.sensors.prior_fit import Fitted, Scatter, Unknowns, fit_with_scatter, robust_inliers
from sequential.sensors.recording import ImuRecording

__all__ = ["GyroBetweenDwells", "GyroFit"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
FEWEST = 5  # intervals
DOUBT, FREE = 1e-3, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class GyroFit:
    """A calibrated gyro, and what every move between two dwells says about it.

    `before`, `after` and `left_out` (S,) are the angle, rad, between gravity as the gyro carries it over the
    move and as the accelerometer reads it: with nominal constants, with the fitted ones, and with constants
    fitted to the other moves.  `accel` is the accelerometer's calibration with what the moves add to it:
    much where its positions left a misalignment open.  `used` (S,) is False for a move that no
    constants explain, `whole` (S,) False where readings are at the end of the gyro's range or missing.
    """

    calibration: AffineCalibration
    accel: AffineCalibration
    fit: Fitted
    rest: GyroAtRest
    seconds: Array  # (S, 2) beginning and end of the move
    used: Mask
    whole: Mask
    before: Array
    after: Array
    left_out: Array
    findings: tuple[Finding, ...]

    @property
    def leave_one_out_rms(self) -> float:
        """Root mean square of `left_out` over the moves that were used and are whole, rad."""
        chosen = self.used & self.whole
        return float(np.sqrt(np.mean(self.left_out[chosen if chosen.any() else self.used] ** 2)))


@dataclass(frozen=True, slots=True)
class GyroBetweenDwells:
    """Settings of the fit.

    Parameters
    ----------
    edge : length of the part of a dwell next to a move that gives gravity's direction, s
    gain, cross : prior standard deviations of the gains and of the other elements, relative
    scatter : of an arriving direction beyond its noise, rad, and how many moves that guess is worth
    """

    edge: float = 0.3
    gain: float = 0.05
    cross: float = 0.05
    scatter: Scatter = field(default_factory=lambda: Scatter(5e-4, 1.0))

    def calibrate(
        self, recording: ImuRecording, dwells: Dwells, accel: AffineCalibration, *, used: Mask | None = None
    ) -> GyroFit:
        """Fit matrix and offset of the gyro; its frame becomes that of the calibrated accelerometer.

        Parameters
        ----------
        accel : calibration of the accelerometer, from the same dwells
        used : (K,) dwells that the accelerometer's fit could use

        Raises
        ------
        DataError, UnderConstrainedError
            where there is no gyro, or where the moves are too few or turn about too few axes.
        """
        recording.require("accel", "gyro", si=False)
        assert dwells.accel is not None  # noqa: S101 - require() has looked
        rest = bias_at_rest(dwells, accel.apply(dwells.accel))
        good = np.ones(len(dwells), dtype=bool) if used is None else used
        moves = np.flatnonzero(good[:-1] & good[1:] & (dwells.part[:-1] == dwells.part[1:]))
        if len(moves) < FEWEST:
            raise UnderConstrainedError(
                f"{recording.name!r} holds {len(moves)} moves between dwells, the gyro needs {FEWEST}: "
                "turn the sensor to ten positions or more, about every axis"
            )
        case = GyroCase.of(recording, dwells, accel, rest, moves, self.edge)
        _require_agreement(recording.name, case)
        fit, chosen = self._without_impossible(case)
        _require_turned(recording.name, fit)
        return _result(recording, dwells, case, fit, chosen, moves)

    def unknowns(self, case: GyroCase) -> Unknowns:
        """Parameters (12 + q,).

        The matrix over its nominal gain, row by row, the offset times that gain, and what is doubtful about
        the accelerometer's constants in their own standard deviations.
        """
        doubts = case.doubt.shape[1]
        centre = np.concatenate([np.eye(3).ravel(), case.rest.bias * case.gain, np.zeros(doubts)])
        bias_sigma = np.sqrt(np.diag(case.rest.cov)) * case.gain + 1e-7
        matrix_sigma = np.where(np.eye(3, dtype=bool).ravel(), self.gain, self.cross)
        return Unknowns(centre, np.concatenate([matrix_sigma, bias_sigma, np.ones(doubts)]))

    def fit(self, case: GyroCase, used: Mask) -> Fitted:
        """Most probable parameters from some of the moves."""
        chosen = case.only(used)
        return fit_with_scatter(chosen.residuals, lambda _: chosen.noise, self.unknowns(case), self.scatter)

    def _without_impossible(self, case: GyroCase) -> tuple[Fitted, Mask]:
        """Leave out moves that the others make impossible, and take back those doubted wrongly."""
        from scipy.special import stdtrit

        count = len(case.before)
        floor = case.noise + (2 * self.scatter.guess) ** 2
        used = robust_inliers(case.residuals, floor, self.unknowns(case), width=2, rounds=8)
        if used.sum() < max(FEWEST, count // 2):
            used = np.ones(count, dtype=bool)
        fit = self.fit(case, used)
        for _ in range(count):
            score = np.empty(count)
            score[used] = _left_out(fit)[1]
            if not used.all():
                score[~used] = _foreseen(case.only(~used), fit)
            score /= -stdtrit(max(fit.freedom, 1.0), DOUBT / 4 / count)
            worst = int(np.argmax(np.where(used, score, 0.0)))
            best = int(np.argmin(np.where(used, np.inf, score)))
            if not used[best] and score[best] < 1:
                used[best] = True
            elif score[worst] > 1 and used.sum() > FEWEST:
                used[worst] = False
            else:
                break
            fit = self.fit(case, used)
        return fit, used


def _foreseen(case: GyroCase, fit: Fitted) -> Array:
    """Miss of moves (S,) that the fit has not seen, over its sigma."""
    residual, J = case.residuals(fit.parameters)
    residual, J = residual.reshape(-1, 2), J.reshape(-1, 2, J.shape[1])
    noise = (case.noise.reshape(-1, 2) + fit.scatter**2)[:, :, None] * np.eye(2)
    whole = noise + J @ fit.cov @ J.transpose(0, 2, 1)
    return np.asarray(np.sqrt(np.einsum("si,sij,sj->s", residual, np.linalg.inv(whole), residual)))


def _left_out(fit: Fitted) -> tuple[Array, Array]:
    """Angle (S,) by which each move is missed when the others are fitted (linearised), and over its sigma."""
    residual, J = fit.residual.reshape(-1, 2), fit.jacobian.reshape(-1, 2, fit.jacobian.shape[1])
    noise = fit.variance.reshape(-1, 2)[:, :, None] * np.eye(2)
    spread = J @ fit.cov @ J.transpose(0, 2, 1)
    missed = np.linalg.solve((noise - spread) @ np.linalg.inv(noise), residual[..., None])
    whole = noise @ np.linalg.inv(noise - spread) @ noise  # variance of a reading less what others expect
    square = np.einsum("sij,sik,skl->sjl", missed, np.linalg.inv(whole), missed)[:, 0, 0]
    return np.linalg.norm(missed[..., 0], axis=1), np.sqrt(square)


def _require_agreement(name: str, case: GyroCase) -> None:
    """Nominal constants must carry gravity roughly to where it is; no gain error of a chip explains 40 %."""
    nominal = case.angles(np.eye(3) * case.gain, case.rest.bias, case.accel)
    if np.median(nominal) > max(0.4 * float(np.median(case.moved())), np.radians(10.0)):
        raise DataError(
            f"gyro and accelerometer of {name!r} disagree about the moves: gravity arrives off by "
            f"{np.degrees(np.median(nominal)):.0f}° in the median; are axes swapped, a sign inverted, or "
            "degrees taken for radians?"
        )


def _require_turned(name: str, fit: Fitted) -> None:
    unseen = [axis for axis, k in zip("xyz", (0, 4, 8), strict=True) if fit.kept[k] > FREE]
    if unseen:
        raise UnderConstrainedError(
            f"the moves of {name!r} hardly turn about {' and '.join(unseen)}: the gyro's gain there stays "
            "unknown; add moves about that axis while it is level"
        )


def _result(
    recording: ImuRecording,
    dwells: Dwells,
    case: GyroCase,
    fit: Fitted,
    used: Mask,
    moves: NDArray[np.int64],
) -> GyroFit:
    gain = case.gain
    scale = np.concatenate([np.full(9, gain), np.full(3, 1 / gain)])
    matrix, offset = fit.parameters[:9].reshape(3, 3) * gain, fit.parameters[9:12] / gain
    accel = case.refined(fit.parameters, fit.cov)
    calibration = AffineCalibration(
        matrix,
        offset,
        fit.cov[:12, :12] * np.outer(scale, scale),
        "gyro",
        recording.gyro_unit,
        "rad/s",
        float(np.sqrt(np.mean(fit.residual**2))),
        f"{recording.name}: {int(used.sum())} moves between dwells",
    )
    left_out = np.full(len(used), np.nan)
    left_out[used] = _left_out(fit)[0]
    seconds = np.stack([dwells.seconds[moves, 1], dwells.seconds[moves + 1, 0]], axis=1)
    return GyroFit(
        calibration,
        accel,
        fit,
        case.rest,
        seconds,
        used,
        case.intervals.clipped == 0,
        case.angles(np.eye(3) * gain, case.rest.bias, case.accel),
        case.angles(matrix, offset, accel),
        left_out,
        _findings(seconds, case, fit, used),
    )


def _findings(seconds: Array, case: GyroCase, fit: Fitted, used: Mask) -> tuple[Finding, ...]:
    found = []
    clipped = np.flatnonzero(case.intervals.clipped)
    if len(clipped):
        times = ", ".join(f"{seconds[k, 0]:.0f}-{seconds[k, 1]:.0f} s" for k in clipped)
        what = f"the gyro's range ends, or samples are missing, in {len(clipped)} of {len(used)} moves"
        found.append(Finding("warn", what, times, "they weigh less: move more slowly, or widen the range"))
    found += [
        Finding("warn", "no constants explain this move, it was left out", f"{a:.1f}-{b:.1f} s", "repeat it")
        for a, b in seconds[~used]
    ]
    if case.rest.g_sensitivity is not None:
        worst = float(np.abs(case.rest.g_sensitivity).max() * case.gain * 9.80665)
        what = f"the gyro reads gravity: up to {np.degrees(worst):.3f} °/s for 1 g; it was taken off"
        found.append(Finding("note", what, "", "apply the bundle's g_sensitivity with the accelerometer"))
    vague = [f"{'xyz'[k // 3]}{'xyz'[k % 3]}" for k in range(9) if fit.kept[k] > 0.7 and k % 4]
    if vague:
        what = f"misalignment {', '.join(vague)} cannot be seen from these moves and stays near zero"
        found.append(Finding("warn", what, "", "add moves about the other axes"))
    return tuple(found)
