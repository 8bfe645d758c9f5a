"""Making a model better than the sample it came from: local optimisation.

Reweighted least squares on the rows that agree, within a limit that narrows to the threshold, and the same
from random subsets of them (Chum, Matas, Kittler 2003, "Locally optimized RANSAC"; Lebeda, Matas, Chum 2012).
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

__all__ = ["climb", "inner_samples"]

wi1, wu1 = types.int64[::1], types.uint64[::1]
WIDEST, STEPS = 9.0, 4  # the limit begins at three thresholds


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
