"""Accelerometer calibration from many positions (gain, offset, misalignment) or from six (gain, offset)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, UnderConstrainedError
from sequential.sensors.calibration import AffineCalibration
from sequential.sensors.dwells import Dwells
from sequential.sensors.finding import Finding
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.gravity_fit import (
    NAMES,
    Prior,
    fit_norm,
    foreseen,
    matrix_of,
    norm_jacobian,
    norms,
    steady_dwells,
)
from sequential.sensors.positions import missing_positions
from sequential.sensors.prior_fit import Fitted

__all__ = ["AccelerometerFit", "MultiPosition"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
ALONE = 0.005  # of g, expected from the others: they know nothing of that dwell
FREE, DOUBTFUL = 0.5, 0.7  # posterior over prior standard deviation: not observed
DOUBT = 1e-3  # probability that a good recording loses a dwell


@dataclass(frozen=True, slots=True, eq=False)
class AccelerometerFit:
    """A calibrated accelerometer, and what every dwell says about it.

    `before`, `after` and `left_out` (K,) are |mean| - g in m/s²: with nominal constants, with the fitted
    ones, and with constants fitted to the *other* dwells.  `used` (K,) is False for a dwell that disagrees
    with all others; such a dwell has no part in any fit.
    """

    calibration: AffineCalibration
    fit: Fitted
    dwells: Dwells
    gravity: float
    used: Mask
    before: Array
    after: Array
    left_out: Array
    sigmas: Array  # (K,) expected spread of left_out
    findings: tuple[Finding, ...]

    @property
    def leave_one_out_rms(self) -> float:
        """Root mean square of `left_out` over dwells that are used and checked, m/s²; NaN for none."""
        chosen = self.left_out[self.used & self.checked]
        return float(np.sqrt(np.mean(chosen**2))) if len(chosen) else float("nan")

    @property
    def checked(self) -> Mask:
        """Dwells (K,) that the others say something about: not the only one with an axis up, say."""
        return np.asarray(self.sigmas < ALONE * self.gravity)


@dataclass(frozen=True, slots=True)
class MultiPosition:
    """Settings of the fit.

    Parameters
    ----------
    gravity : |g| where the recording was made, m/s²
    shears : False for gain and offset per axis alone, as from six positions
    six : also require all six positions, an axis up and down each
    prior : what is known of any accelerometer
    """

    gravity: float = STANDARD_GRAVITY
    shears: bool = True
    six: bool = False
    prior: Prior = field(default_factory=Prior)

    def calibrate(self, dwells: Dwells, source: str = "") -> AccelerometerFit:
        """Fit the dwells' means.

        Raises
        ------
        DataError, UnderConstrainedError
            where there are too few dwells, or where their directions leave a gain or an offset free.
        """
        if dwells.accel is None or dwells.accel_cov is None:
            raise DataError(f"recording {dwells.name!r} has no accelerometer")
        self._require_enough(dwells)
        means, covs = dwells.accel, dwells.accel_cov
        start = nominal(means, self.gravity, si=dwells.accel_unit == "m/s^2")
        self._require_unit(dwells)
        self._require_observed(dwells, foreseen(means, self.gravity, start, self.prior, shears=self.shears))
        used = steady_dwells(means, covs, self.gravity, start, self.prior, shears=self.shears)
        used, left_out, sigmas = self._cross_validated(dwells, used)
        fit = self._fit(dwells, used)
        sigmas_prior = np.sqrt(np.diag(fit.cov)) / fit.kept
        self._require_observed(dwells, fit.cov / np.outer(sigmas_prior, sigmas_prior))
        return AccelerometerFit(
            self._calibration(fit, dwells, used, source),
            fit,
            dwells,
            self.gravity,
            used,
            norms(start, means) - self.gravity,
            norms(fit.parameters, means) - self.gravity,
            left_out,
            sigmas,
            self._findings(dwells, fit, used, left_out, sigmas),
        )

    def _fit(self, dwells: Dwells, used: Mask) -> Fitted:
        assert dwells.accel is not None  # noqa: S101 - calibrate() has looked
        assert dwells.accel_cov is not None  # noqa: S101
        means = dwells.accel[used]
        start = nominal(means, self.gravity, si=dwells.accel_unit == "m/s^2")
        return fit_norm(means, dwells.accel_cov[used], self.gravity, start, self.prior, shears=self.shears)

    def _cross_validated(self, dwells: Dwells, used: Mask) -> tuple[Mask, Array, Array]:
        """Predict every dwell from the others: impossible ones leave, wrongly doubted ones return."""
        from scipy.special import stdtrit

        assert dwells.accel is not None  # noqa: S101 - calibrate() has looked
        assert dwells.accel_cov is not None  # noqa: S101
        count = len(dwells)
        left_out, sigmas, limit = np.empty(count), np.empty(count), np.empty(count)
        for _ in range(count):
            for k in range(count):
                fit = self._fit(dwells, used & (np.arange(count) != k))
                mean = dwells.accel[k : k + 1]
                slope = norm_jacobian(fit.parameters, mean)[0]
                noise = slope[6:] @ dwells.accel_cov[k] @ slope[6:] + fit.scatter**2
                left_out[k] = norms(fit.parameters, mean)[0] - self.gravity
                sigmas[k] = np.sqrt(noise + slope @ fit.cov @ slope)
                limit[k] = -stdtrit(fit.freedom + self.prior.scatter_weight, DOUBT / 2 / count)
            score = np.abs(left_out) / sigmas / limit
            worst = int(np.argmax(np.where(used, score, 0.0)))
            best = int(np.argmin(np.where(used, np.inf, score)))
            if not used[best] and score[best] < 1.0:
                used = used | (np.arange(count) == best)
            elif score[worst] > 1.0 and used.sum() > self._fewest:
                used = used & (np.arange(count) != worst)
            else:
                break
        return used, left_out, sigmas

    def _require_unit(self, dwells: Dwells) -> None:
        """In SI units the length at rest is near g, whatever the constants of a chip."""
        assert dwells.accel is not None  # noqa: S101 - calibrate() has looked
        length = float(np.median(np.linalg.norm(dwells.accel, axis=1)))
        if dwells.accel_unit == "m/s^2" and not 0.7 < length / self.gravity < 1.4:
            raise DataError(
                f"the accelerometer of {dwells.name!r} reads {length:.3g} m/s² at rest, expected "
                f"{self.gravity:.2f}: the unit is another one (g? counts?); give it when reading"
            )

    @property
    def _fewest(self) -> int:
        return 6

    def _require_enough(self, dwells: Dwells) -> None:
        if self.six and (missing := missing_positions(dwells)):
            raise UnderConstrainedError(
                f"six positions need every axis up and down; {dwells.name!r} has no position with "
                f"{' nor '.join(missing)}; its gain and offset cannot be told apart, record it as well"
            )
        if len(dwells) < self._fewest:
            raise UnderConstrainedError(
                f"{dwells.name!r} holds {len(dwells)} dwells; gain and offset need {self._fewest} positions "
                "at least and the misalignment nine: hold more positions, 3 s each"
            )

    def _require_observed(self, dwells: Dwells, cov: Array) -> None:
        """Gains and offsets must come from the data; a combination of them may be what is free.

        `cov` (9, 9) is over the prior's standard deviations.
        """
        chosen = np.r_[0:3, 6:9]
        values, vectors = np.linalg.eigh(cov[np.ix_(chosen, chosen)])
        if values[-1] <= FREE**2:
            return
        blamed = [
            NAMES[chosen[k]]
            for k in np.flatnonzero((np.abs(vectors[:, values > FREE**2]) > 0.35).any(axis=1))
        ]
        raise UnderConstrainedError(
            f"the positions of {dwells.name!r} leave {', '.join(blamed)} undetermined: gravity's directions "
            f"lie in one plane or on one side; add positions with {_axes(blamed)} pointing up and down"
        )

    def _calibration(self, fit: Fitted, dwells: Dwells, used: Mask, source: str) -> AffineCalibration:
        J = matrix_jacobian(fit.parameters)
        return AffineCalibration(
            matrix_of(fit.parameters),
            fit.parameters[6:],
            J @ fit.cov @ J.T,
            "accel",
            dwells.accel_unit,
            "m/s^2",
            float(np.sqrt(np.mean(fit.residual**2))),
            source or f"{dwells.name}: {int(used.sum())} dwells, g = {self.gravity:.5f} m/s^2",
        )

    def _findings(
        self, dwells: Dwells, fit: Fitted, used: Mask, left_out: Array, sigmas: Array
    ) -> tuple[Finding, ...]:
        found = []
        for k in np.flatnonzero(~used):
            start, stop = dwells.seconds[k]
            what = f"dwell {k + 1} disagrees with all others by {left_out[k]:+.3f} m/s² and was left out"
            found.append(Finding("warn", what, f"{start:.1f}-{stop:.1f} s", "repeat it if it matters"))
        if self.shears:
            vague = [NAMES[k] for k in range(3, 6) if fit.kept[k] > DOUBTFUL]
            if vague:
                planes = ", ".join(f"{name[-1]} and {name[-2]}" for name in vague)
                what = f"{', '.join(vague)} cannot be seen from these positions and stays near zero"
                found.append(Finding("warn", what, "", f"add positions half way between axes: {planes}"))
        alone = np.flatnonzero(used & (sigmas > ALONE * self.gravity)) + 1
        if len(alone):
            which = ", ".join(str(k) for k in alone)
            one, them = ("dwell", "it") if len(alone) == 1 else ("dwells", "one of them")
            what = f"nothing checks {one} {which}: without {them} an axis is open"
            found.append(Finding("warn", what, "", "hold such a position once more"))
        elif fit.freedom < 3:
            unknowns = 9 if self.shears else 6
            what = f"{int(used.sum())} dwells for {unknowns} unknowns: hardly anything is left to check"
            found.append(Finding("warn", what, "", "record 15 positions or more"))
        return tuple(found)


def nominal(means: Array, gravity: float, *, si: bool) -> Array:
    """Constants of a sensor in order: its data sheet's, or one gain and the middle of its readings."""
    if si:
        return np.concatenate([np.ones(3), np.zeros(6)])
    middle = (means.min(axis=0) + means.max(axis=0)) / 2
    gain = gravity / float(np.median(np.linalg.norm(means - middle, axis=1)))
    return np.concatenate([np.full(3, gain), np.zeros(3), middle])


def matrix_jacobian(parameters: Array) -> Array:
    """Derivative (12, 9) of the matrix, row by row, and the offset."""
    J = np.zeros((12, 9))
    matrix = matrix_of(parameters)
    for column in range(3):
        J[column:9:3, column] = matrix[:, column] / parameters[column]
    for k, (a, b) in enumerate(((1, 0), (2, 0), (2, 1))):
        J[3 * a + b, 3 + k] = parameters[b]
    J[9:, 6:] = np.eye(3)
    return J


def _axes(names: list[str]) -> str:
    return " and ".join(sorted({name[-1] for name in names}))
