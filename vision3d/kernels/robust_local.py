"""Making a model better than the sample it came from: local optimisation, and the last fit of all.

Reweighted least squares on the rows that agree, within a limit that narrows to the threshold, and the same
from random subsets of them (Chum, Matas, Kittler 2003, "Locally optimized RANSAC"; Lebeda, Matas, Chum 2012).
At the end the errors are taken for a mixture of Gaussian noise of unknown sigma and of chance agreement, and
each row weighs as probably as it is of the first kind.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import b0, f0, f1, f2, i0, i1, w1
from vision3d.kernels.robust_calls import call, pointer
from vision3d.kernels.robust_sampling import draw
from vision3d.kernels.robust_scoring import errors_of, score

__all__ = ["climb", "inner_samples", "polish"]

wi1, wu1 = types.int64[::1], types.uint64[::1]
WIDEST, STEPS = 9.0, 4  # the limit begins at three thresholds
ROUNDS, SETTLED = 30, 1e-10
BLENDED = 0.16  # (sigma / threshold)² up to which noise can be told from chance
EVER = 1e-4  # share of chance agreement that is never ruled out


@inlined
def fit_within(functions, data, weights, limit2, model, errors, share):
    """One fit to the rows whose error is below the limit; returns how many they are, 0 where it failed."""
    n = errors.shape[0]
    errors_of(functions[1], data, weights, model, errors)
    agree = 0
    for i in range(n):
        inside = errors[i] < limit2
        share[i] = weights[i] if inside else 0.0
        agree += 1 if inside else 0
    fine = call(functions[2], pointer(data, 0), n, data.shape[1], pointer(share, 0), pointer(model, 0))
    return agree if fine > 0 else 0


@kernel(i0(i1, f2, f1, f0, i0, w1, w1, w1), inline="never")
def climb(functions, data, weights, threshold2, n, model, errors, share):
    """Improve a model on the first n rows; 0 where a fit failed, and the model is then of no use."""
    for step in range(STEPS):
        limit2 = threshold2 * (1.0 + (WIDEST - 1.0) * (STEPS - 1 - step) / (STEPS - 1))
        if fit_within(functions, data, weights, limit2, model, errors[:n], share[:n]) < 1:
            return 0
    return 1


@kernel(i0(i1, f2, f1, f0, b0, i0, i0, w1, w1, w1, w1, w1, wi1, wu1), inline="never")
def inner_samples(
    functions,
    data,
    weights,
    threshold2,
    counting,
    times,
    size,
    model,
    errors,
    share,
    room,
    told,
    chosen,
    random,
):
    """Improve a model by fits to random subsets of the rows that agree with it; returns how often it did."""
    n, k = data.shape
    none = np.array([0.0, 0.0, math.inf])
    rows, ones, trial = np.empty((size, k)), np.empty(size), np.empty(model.shape[0])
    best = score(functions[1], data, weights, model, threshold2, counting, math.inf, none, room, told)
    errors_of(functions[1], data, weights, model, errors)
    agree, better = 0, 0
    for i in range(n):
        if errors[i] < threshold2:
            chosen[agree] = i
            agree += 1
    if agree < 2 * size:
        return 0
    sample = np.empty(size, np.int64)
    for _ in range(times):
        draw(random, agree, 0, size, sample)
        for i in range(size):
            ones[i] = weights[chosen[sample[i]]]
            rows[i] = data[chosen[sample[i]]]
        trial[:] = model
        if call(functions[2], pointer(rows, 0), size, k, pointer(ones, 0), pointer(trial, 0)) < 1:
            continue
        if climb(functions, data, weights, threshold2, n, trial, errors, share) < 1:
            continue
        found = score(functions[1], data, weights, trial, threshold2, counting, best, none, room, told)
        if found < best:
            best = found
            model[:] = trial
            better += 1
    return better


@inlined
def noise_step(errors, weights, threshold2, dof, sigma2, noise, share):
    """One step of expectation and maximisation: fills share, returns sigma² and the share of noise."""
    n = errors.shape[0]
    room = 2.0 * math.sqrt(threshold2) if dof == 1 else math.pi * threshold2
    if dof == 3:
        room = 4.0 / 3.0 * math.pi * threshold2**1.5
    peak = noise * (2.0 * math.pi * sigma2) ** (-0.5 * dof)
    floor = (1.0 - noise) / room
    total, squares, inside = 0.0, 0.0, 0
    for i in range(n):
        share[i] = 0.0
        if errors[i] < threshold2:
            likely = peak * math.exp(-0.5 * errors[i] / sigma2)
            part = likely / (likely + floor)
            total += part
            squares += part * errors[i]
            inside += 1
            share[i] = part * weights[i]
    if not total > 0.0:
        return 0.0, 0.0
    return squares / (dof * total), min(total / inside, 1.0 - EVER)


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


@kernel(f0(i1, f2, f1, f0, i0, b0, w1, w1, w1))
def polish(functions, data, weights, threshold2, dof, blend, model, errors, share):
    """The last fit, which leaves errors and share of the model: returns sigma² of an error's component.

    Truncated least squares until it settles; then, with `blend` and where the noise is well within the
    threshold, the mixture.
    """
    n, k = data.shape
    trial = model.copy()
    best = math.inf
    for _ in range(ROUNDS):
        errors_of(functions[1], data, weights, trial, errors)
        squares, agree = weigh(errors, weights, threshold2, share)
        cost = squares + (n - agree) * threshold2
        if not cost < best * (1.0 - SETTLED):
            break
        best = cost
        model[:] = trial
        if call(functions[2], pointer(data, 0), n, k, pointer(share, 0), pointer(trial, 0)) < 1:
            break
    errors_of(functions[1], data, weights, model, errors)
    squares, agree = weigh(errors, weights, threshold2, share)
    sigma2 = squares / (dof * max(agree, 1))
    if not blend or not 0.0 < sigma2 < BLENDED * threshold2:
        return sigma2
    noise = 1.0 - 10.0 * EVER
    trial[:] = model
    for _ in range(ROUNDS):
        before = sigma2
        sigma2, noise = noise_step(errors, weights, threshold2, dof, sigma2, noise, share)
        if not sigma2 > 0.0:
            break
        if call(functions[2], pointer(data, 0), n, k, pointer(share, 0), pointer(trial, 0)) < 1:
            break
        errors_of(functions[1], data, weights, trial, errors)
        model[:] = trial
        if abs(sigma2 - before) < 1e-5 * before:
            break
    return sigma2
