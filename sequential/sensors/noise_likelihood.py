"""Likelihood of the four noise terms, its greatest value, and how far each term may go.

Restricted likelihood (the mean and a linear drift are projected out), Fisher scoring with terms that cannot
be negative, and profile-likelihood intervals (Wilks 1938; Self and Liang 1987 at the edge of the parameters).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotConvergedError
from sequential.sensors.noise_spectrum import CosineSpectrum, Low

__all__ = ["Fit", "drift", "maximise", "profile"]

Array = NDArray[np.float64]
CHI_95 = 3.841458820694124
# 3.84 holds far from the edge.  Where a term that is not there takes up some of another's share, the interval
# of the other would miss 7 times in a hundred (N beside Q, Monte Carlo of 800), hence a little more.
FALL = 4.25
ROUNDS, HALVINGS, FARTHEST = 80, 30, 256.0
TOLERANCE, NEAR = 1e-6, 5e-3
FLICKER = 2


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Where the likelihood is greatest: squares of Q, N, B, K (4,), its logarithm and Fisher information."""

    square: Array
    log_likelihood: float
    information: Array


def evaluate(spectrum: CosineSpectrum, square: Array) -> tuple[float, Array, Array] | None:
    """Log likelihood, its gradient (4,), and the Fisher information (4, 4); None where a variance is none."""
    variance = square @ spectrum.weight
    if not (variance > 0.0).all():
        return None
    share = spectrum.weight / variance
    ratio = spectrum.power / variance
    value = -0.5 * float(spectrum.freedom @ np.log(variance) + ratio.sum())
    gradient = 0.5 * share @ (ratio - spectrum.freedom)
    information = 0.5 * (share * spectrum.freedom) @ share.T
    for low in spectrum.low:
        part = _evaluate_low(low, square)
        if part is None:
            return None
        value, gradient, information = value + part[0], gradient + part[1], information + part[2]
    return value, gradient, information


def _evaluate_low(low: Low, square: Array) -> tuple[float, Array, Array] | None:
    covariance = square[FLICKER] * low.flicker
    covariance[np.diag_indices_from(covariance)] += square @ low.weight
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        return None
    P = np.linalg.inv(covariance)
    value = -float(np.log(np.diag(root)).sum())
    if low.drift is not None:
        along = P @ low.drift
        strength = float(low.drift @ along)
        value -= 0.5 * math.log(strength)
        P -= np.outer(along, along) / strength
    score = P @ low.value
    value -= 0.5 * float(low.value @ score)
    coloured = P @ low.flicker
    gradient = low.weight @ (score**2 - np.diag(P))
    gradient[FLICKER] = score @ low.flicker @ score - np.trace(coloured)
    information = low.weight @ (P * P) @ low.weight.T
    cross = low.weight @ np.einsum("ij,ij->i", coloured @ P, np.eye(len(P)))
    cross[FLICKER] = np.sum(coloured * coloured.T)
    information[FLICKER], information[:, FLICKER] = cross, cross
    return value, 0.5 * gradient, 0.5 * information


def maximise(spectrum: CosineSpectrum, start: Array | None = None, fixed: int | None = None) -> Fit | None:
    """Scoring from a start, with one term held at its start if wanted.

    Returns None where the start is impossible.

    Raises
    ------
    NotConvergedError
    """
    from scipy.optimize import nnls

    square = _guess(spectrum) if start is None else np.array(start)
    free = [c for c in range(4) if c != fixed]
    here = evaluate(spectrum, square)
    if here is None:
        return None
    for _ in range(ROUNDS):
        value, gradient, information = here
        unit = 1.0 / np.sqrt(np.diag(information))
        scaled = information * np.outer(unit, unit) + 1e-9 * np.eye(4)
        root = np.linalg.cholesky(scaled).T
        # the quadratic model's greatest value where nothing is negative, as non-negative least squares
        target = root @ (square / unit) + np.linalg.solve(root.T, gradient * unit)
        if fixed is not None:
            target -= root[:, fixed] * (square[fixed] / unit[fixed])
        step = np.zeros(4)
        step[free] = nnls(root[:, free], target)[0] * unit[free] - square[free]
        if gradient @ step < TOLERANCE:
            return Fit(square, value, information)
        found = _climb(spectrum, square, step, value, float(gradient @ step))
        if found is None:
            return Fit(square, value, information)
        square, here = found
        if here[0] - value < TOLERANCE:
            return Fit(square, here[0], here[2])
    raise NotConvergedError(
        f"the noise terms did not settle in {ROUNDS} rounds; the record is unlike still noise: plot it"
    )


def _climb(
    spectrum: CosineSpectrum, square: Array, step: Array, value: float, slope: float
) -> tuple[Array, tuple[float, Array, Array]] | None:
    for halving in range(HALVINGS):
        part = 0.5**halving
        there = square + part * step
        found = evaluate(spectrum, there)
        # a step that is too long would swing to and fro: ask for a good part of what a parabola gives
        if found is not None and found[0] > value + 0.2 * part * slope:
            straight = found[0] > value + 0.7 * part * slope
            return _farther(spectrum, square, step, found) if straight else (there, found)
    return None


def _farther(
    spectrum: CosineSpectrum, square: Array, step: Array, found: tuple[float, Array, Array]
) -> tuple[Array, tuple[float, Array, Array]]:
    """Where the likelihood still climbs at the end of a step, longer steps in the same direction."""
    there, stretch = square + step, 1.0
    while stretch < FARTHEST:
        stretch *= 2.0
        beyond = np.maximum(square + stretch * step, 0.0)
        better = evaluate(spectrum, beyond)
        if better is None or better[0] <= found[0]:
            break
        there, found = beyond, better
    return there, found


def _guess(spectrum: CosineSpectrum) -> Array:
    """White noise of half the power, and a little of everything else."""
    white = float(spectrum.power.sum() / max(spectrum.freedom.sum(), 1.0))
    lowest = float(np.mean(np.concatenate([low.value**2 for low in spectrum.low])))
    mean = np.mean([low.weight[3].mean() for low in spectrum.low])
    return np.array(
        [
            1e-3 * white / spectrum.weight[0].max(),
            0.5 * white,
            1e-2 * white / spectrum.weight[2].mean(),
            1e-3 * max(lowest, white) / mean,
        ]
    )


def profile(spectrum: CosineSpectrum, fit: Fit, term: int) -> tuple[float, float]:
    """95 % interval of one coefficient (not of its square): twice the log likelihood falls by 4.25.

    Worked out along the coefficient, in which the fall is nearly a parabola.
    """
    best = math.sqrt(fit.square[term])
    width = 1.0 / math.sqrt(float(fit.information[term, term]))
    width = width / (2.0 * best) if best * best > width else math.sqrt(width)

    def fall(value: float, warm: Array) -> tuple[float, Array]:
        start = warm.copy()
        start[term] = value * value
        return _loss(fit, maximise(spectrum, start, fixed=term), warm)

    low = _edge(fall, fit.square, best, -2.0 * width) if best > 0.0 else 0.0
    return low, _edge(fall, fit.square, best, 2.0 * width)


def drift(spectrum: CosineSpectrum, square: Array) -> tuple[float, ...]:
    """Drift a sample by generalised least squares, and its 95 % interval, with the terms (4,) given.

    A drift and a random walk look alike, so `square` should hold the strongest walk that is still likely:
    with the most likely one, which is often none, the interval would miss the truth one time in four.
    """
    odd = spectrum.low[0]
    assert odd.drift is not None  # noqa: S101 - odd coefficients feel a drift
    covariance = square[FLICKER] * odd.flicker + np.diag(square @ odd.weight)
    along = np.linalg.solve(covariance, odd.drift)
    strength = float(along @ odd.drift)
    best, width = float(along @ odd.value) / strength, math.sqrt(CHI_95 / strength)
    return tuple(spectrum.slope + best + side * width for side in (0.0, -1.0, 1.0))


def _loss(best: Fit, found: Fit | None, warm: Array) -> tuple[float, Array]:
    """Twice the loss of log likelihood, and where the other terms have gone."""
    if found is None:
        return math.inf, warm
    return max(2.0 * (best.log_likelihood - found.log_likelihood), 0.0), found.square


def _edge(
    fall: Callable[[float, Array], tuple[float, Array]],
    warm: Array,
    best: float,
    stride: float,
) -> float:
    """Where the fall from `best` reaches 4.25, sought a stride away, or zero."""
    inside, outside = best, math.nan
    far = best + stride
    for _ in range(60):
        far = max(far, 0.0)
        lost, warm = fall(far, warm)
        if lost < FALL:
            if far == 0.0:
                return 0.0
            inside = far
        else:
            outside = far
        if abs(lost - FALL) < NEAR * FALL or abs(outside - inside) < 1e-4 * abs(inside - best):
            return far
        parabola = best + (far - best) * math.sqrt(FALL / lost) if 0.0 < lost < math.inf else math.nan
        if math.isnan(outside):
            far = best + 2.0 * (far - best) if math.isnan(parabola) else parabola + 0.2 * (parabola - best)
            continue
        near, wide = sorted((inside, outside))
        margin = 0.02 * (wide - near)
        far = parabola if near + margin < parabola < wide - margin else 0.5 * (near + wide)
    return far
