"""The last fit of all, to the rows that agree: how much each of them is to be believed.

Truncated least squares until it settles.  Then the errors are taken for a mixture: Gaussian noise of unknown
sigma, the same noise some times as wide (real matches have such tails), and chance agreement.  A row weighs
by its expected precision, and expectation and maximisation go on in turn with the fit (Dempster, Laird, Rubin
1977).  For errors that are Gaussian this is least squares; for others it is a redescending M-estimate.
"""

from __future__ import annotations

import math

from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import b0, f0, f1, f2, i0, i1, w1
from vision3d.kernels.robust_calls import call, pointer
from vision3d.kernels.robust_scoring import errors_of

__all__ = ["polish"]

ROUNDS, SETTLED = 30, 1e-10
BLENDS, STEADY = 12, 1e-3
BLENDED = 0.16  # (sigma / threshold)² up to which noise can be told from chance
WIDE = 9.0  # variance of the wide noise over that of the narrow
EVER = 1e-4  # share of each kind that is never ruled out
NARROW_SHARE, WIDE_SHARE, SIGMA2, NOISE2, INFLATION = range(5)  # of mixture
FEWEST = 30  # rows that tell a mixture
EXACT = 1e-6  # (sigma / threshold)² below which the data are taken for exact


@inlined
def room_within(threshold2, dof):
    """Volume of the ball of errors below the threshold, in as many dimensions as an error has."""
    if dof == 1:
        return 2.0 * math.sqrt(threshold2)
    if dof == 2:
        return math.pi * threshold2
    return 4.0 / 3.0 * math.pi * threshold2**1.5


@kernel(f0(w1, f1, f0, i0, w1, w1), inline="never")
def noise_step(errors, weights, threshold2, dof, mixture, share):
    """One step of expectation and maximisation; returns how much sigma² changed, relatively.

    Fills share (n,) with weights and mixture (5,): shares of narrow and wide noise, sigma² of the narrow,
    variance of all noise, and by how much the covariance that the weights promise is too small: the variance
    of an M-estimate (Huber 1981, section 6.3) over sigma² and the weights' mean.
    """
    sigma2, wide2 = mixture[SIGMA2], WIDE * mixture[SIGMA2]
    peak = mixture[NARROW_SHARE] * (2.0 * math.pi * sigma2) ** (-0.5 * dof)
    low = mixture[WIDE_SHARE] * (2.0 * math.pi * wide2) ** (-0.5 * dof)
    floor = (1.0 - mixture[NARROW_SHARE] - mixture[WIDE_SHARE]) / room_within(threshold2, dof)
    narrow = wide = squares = spread = believed = pulled = held = 0.0
    inside = 0
    for i in range(errors.shape[0]):
        share[i] = 0.0
        error = errors[i]
        if not error < threshold2:
            continue
        a = peak * math.exp(-0.5 * error / sigma2)
        b = low * math.exp(-0.5 * error / wide2)
        whole = a + b + floor
        a, b = a / whole, b / whole
        belief = a + b / WIDE
        inside += 1
        narrow += a
        wide += b
        squares += belief * error
        spread += (a + b) * error
        believed += belief
        pulled += belief * belief * error
        held += belief - error / (dof * sigma2) * (a + b / (WIDE * WIDE) - belief * belief)
        share[i] = belief * weights[i]
    noise = narrow + wide
    if not (noise > 0.0 and squares > 0.0 and held > 0.0):
        return 0.0
    found = squares / (dof * noise)
    mixture[NARROW_SHARE] = max(narrow / inside - EVER, EVER)
    mixture[WIDE_SHARE] = max(wide / inside - EVER, EVER)
    mixture[SIGMA2], mixture[NOISE2] = found, spread / (dof * noise)
    mixture[INFLATION] = pulled / dof * believed / (held * held * found)
    return abs(found / sigma2 - 1.0)


@inlined
def weigh(errors, weights, threshold2, share):
    """Fill share with the weights of the rows that agree; returns the sum of their errors and how many."""
    squares, agree = 0.0, 0
    for i in range(errors.shape[0]):
        inside = errors[i] < threshold2
        share[i] = weights[i] if inside else 0.0
        squares += errors[i] if inside else 0.0
        agree += 1 if inside else 0
    return squares, agree


@kernel(types.UniTuple(f0, 2)(i1, f2, f1, f0, w1, w1, w1), inline="never")
def settle(functions, data, weights, threshold2, model, errors, share):
    """Truncated least squares until it settles, leaving errors and share.

    Returns the mean error of the rows that agree, and how many they are.
    """
    n, k = data.shape
    trial, best = model.copy(), math.inf
    for _ in range(ROUNDS):
        errors_of(functions[1], data, weights, trial, errors)
        squares, agree = weigh(errors, weights, threshold2, share)
        cost = squares + (n - agree) * threshold2
        if not cost < best * (1.0 - SETTLED):
            break
        best = cost
        model[:] = trial
        if functions[2] == 0:
            break
        if call(functions[2], pointer(data, 0), n, k, pointer(share, 0), pointer(trial, 0)) < 1:
            break
    errors_of(functions[1], data, weights, model, errors)
    squares, agree = weigh(errors, weights, threshold2, share)
    return squares / max(agree, 1), agree


@kernel(i0(i1, f2, f1, f0, i0, b0, w1, w1, w1, w1))
def polish(functions, data, weights, threshold2, dof, blend, model, errors, share, mixture):
    """The last fit, which leaves errors (n,) and share (n,) of the model, and the mixture (5,) of its noise.

    With `blend` the mixture is fitted, where the noise is well within the threshold and the rows are many;
    returns whether it was.
    """
    n, k = data.shape
    error, agree = settle(functions, data, weights, threshold2, model, errors, share)
    sigma2 = error / dof
    mixture[NARROW_SHARE], mixture[WIDE_SHARE] = 0.8, 0.19
    mixture[SIGMA2], mixture[NOISE2], mixture[INFLATION] = 0.7 * sigma2, sigma2, 1.0
    if (
        functions[2] == 0
        or not blend
        or agree < FEWEST
        or not EXACT * threshold2 < sigma2 < BLENDED * threshold2
    ):
        mixture[SIGMA2] = sigma2
        return 0
    trial = model.copy()
    for _ in range(BLENDS):
        noise_step(errors, weights, threshold2, dof, mixture, share)
        change = noise_step(errors, weights, threshold2, dof, mixture, share)
        if call(functions[2], pointer(data, 0), n, k, pointer(share, 0), pointer(trial, 0)) < 1:
            break
        model[:] = trial
        errors_of(functions[1], data, weights, model, errors)
        if change < STEADY:
            break
    return 1
