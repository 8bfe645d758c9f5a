"""The one RANSAC loop, for any model: its functions come as addresses (`robust_calls` tells their form).

Fischler, Bolles 1981, with local optimisation, Wald's test, MSAC costs and PROSAC's order: what Raguram,
Chum, Pollefeys, Matas, Frahm 2013, "USAC", put together.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import b0, f0, f1, f2, i0, i1, w1
from vision3d.kernels.robust_calls import call, pointer
from vision3d.kernels.robust_local import climb, inner_samples
from vision3d.kernels.robust_sampling import draw, draw_growing, mix
from vision3d.kernels.robust_scoring import errors_of, median_cost, score, trials_needed, wald

wi1, wu1 = types.int64[::1], types.uint64[::1]

__all__ = ["AGREED", "BUDGET", "CONFIDENT", "NONE_FOUND", "robust_loop"]

NONE_FOUND, CONFIDENT, BUDGET, AGREED = 0, 1, 2, 3
THRESHOLD2, CONFIDENCE, TRIALS, KIND, GROWING, LOCAL, PROSAC_TRIALS = range(7)  # of options
SAMPLE, MODELS, BLOCK, INNER, TIMES, SOLVE_COST, REDRAWS = range(7)  # of sizes
MSAC, COUNT, MEDIAN = range(3)  # KIND
ENOUGH = 250  # agreeing rows that a local optimisation looks at
BAD_ROWS = 200.0  # how many rows the first guess of that share is worth
BEST_ROWS, CHANCE = 20, 0.2  # PROSAC: stop by the best rows if at least so many, and so large a share agree
FEWEST = 0.02  # share of agreeing rows below which nothing is given up early
AT_FIRST = 0.005  # share of rows that agree with a bad model


@inlined
def mixed_rows(data, weights, random):
    """Copies in random order, so that the first rows stand for all."""
    n = data.shape[0]
    order = np.arange(n)
    mix(random, order)
    rows, heavy = np.empty_like(data), np.empty(n)
    for i in range(n):
        rows[i] = data[order[i]]
        heavy[i] = weights[order[i]]
    return rows, heavy


@inlined
def first_growth(n, m, trials):
    """PROSAC's state before its first sample."""
    growth = np.empty(3)
    growth[0], growth[1], growth[2] = m, trials, 1.0
    for i in range(m):
        growth[1] *= (m - i) / (n - i)
    return growth


@kernel(i0(i1, f2, f1, f0, w1, w1), inline="never")
def agreeing(functions, rows, weights, threshold2, model, errors):
    """How many rows agree with a model; fills errors (n,)."""
    errors_of(functions[1], rows, weights, model, errors)
    agree = 0
    for i in range(errors.shape[0]):
        agree += 1 if errors[i] < threshold2 else 0
    return agree


@kernel(f0(i1, i1, f2, f1, f0, b0, w1, w1, w1, w1, w1, wi1, wu1), inline="never")
def optimised(
    functions, sizes, rows, weights, threshold2, counting, model, errors, share, room, looked, chosen, random
):
    """Local optimisation of a model, on no more rows than it takes; returns its cost, infinite on failure."""
    n = rows.shape[0]
    agree = max(agreeing(functions, rows, weights, threshold2, model, errors), 1)
    few = min(n, max(ENOUGH * n // agree, 2 * sizes[INNER]))
    if climb(functions, rows, weights, threshold2, few, model, errors, share) < 1:
        return math.inf
    if sizes[TIMES] > 0:
        inner_samples(
            functions,
            rows[:few],
            weights[:few],
            threshold2,
            counting,
            sizes[TIMES],
            sizes[INNER],
            model,
            errors[:few],
            share[:few],
            room,
            looked,
            chosen,
            random,
        )
    none = np.array([0.0, 0.0, math.inf])
    return score(functions[1], rows, weights, model, threshold2, counting, math.inf, none, room, looked)


@inlined
def enough_trials(errors, threshold2, m, confidence, lost, growing):
    """Samples that suffice, from the errors in the order of data; in PROSAC's order also by the best rows."""
    n = errors.shape[0]
    needed, agree = math.inf, 0
    for i in range(n):
        agree += 1 if errors[i] < threshold2 else 0
        size = i + 1
        if size == n or (growing and size >= BEST_ROWS and agree > m + CHANCE * size):
            needed = min(needed, trials_needed(agree, size, m, confidence, lost))
    return needed


@kernel(i0(f2, f1, i1, i1, f1, types.uint64, w1, w1, w1))
def robust_loop(data, weights, functions, sizes, options, seed, model, errors, told):
    """Search for the model of least cost; returns why it stopped.

    Fills model (p,), errors (n,) in the order of data, and told (4,): samples drawn, cost, rows that agree,
    local optimisations.
    """
    n, m = data.shape[0], sizes[SAMPLE]
    threshold2, confidence = options[THRESHOLD2], options[CONFIDENCE]
    growing, median, counting = options[GROWING] > 0.0, options[KIND] == MEDIAN, options[KIND] == COUNT
    random = np.array([seed], np.uint64)
    rows, heavy = mixed_rows(data, weights, random)
    growth = first_growth(n, m, options[PROSAC_TRIALS])
    sample, chosen = np.empty(m, np.int64), np.empty(n, np.int64)
    p = model.shape[0]
    found, candidate, share = np.empty((sizes[MODELS], p)), np.empty(p), np.empty(n)
    room, looked, test = np.empty(min(n, sizes[BLOCK])), np.zeros(2), np.empty(3)
    test[0], test[1], test[2] = 0.0, 0.0, math.inf  # nothing is given up before there is something
    best, best_sample, most, lost, trial, tried = math.inf, math.inf, 0, 0.0, 0, 0
    bad_rows, bad_agree = BAD_ROWS, BAD_ROWS * AT_FIRST
    needed = trials_needed(n // 2, n, m, confidence, 0.0) if median else math.inf
    told[3] = 0.0
    draws = options[TRIALS] * sizes[REDRAWS]
    while tried < options[TRIALS] and trial < needed and trial < draws:
        trial += 1
        if growing:
            draw_growing(random, trial, n, growth, sample)
        else:
            draw(random, n, 0, m, sample)
        models = call(functions[0], pointer(data, 0), n, data.shape[1], pointer(sample, 0), pointer(found, 0))
        tried += 1 if models > 0 else 0
        for s in range(models):
            if median:
                cost = median_cost(functions[1], rows, heavy, found[s], errors)
            else:
                cost = score(
                    functions[1], rows, heavy, found[s], threshold2, counting, best_sample, test, room, looked
                )
            if not cost < best_sample:
                bad_rows += looked[0]
                bad_agree += looked[1]
                continue
            best_sample = cost
            if cost < best:
                best = cost
                model[:] = found[s]
            if median:
                continue
            share_of_sample = looked[1] / n
            if options[LOCAL] > 0.0:
                told[3] += 1.0
                candidate[:] = found[s]
                cost = optimised(
                    functions,
                    sizes,
                    rows,
                    heavy,
                    threshold2,
                    counting,
                    candidate,
                    errors,
                    share,
                    room,
                    looked,
                    chosen,
                    random,
                )
                if cost < best:
                    best = cost
                    model[:] = candidate
            most = agreeing(functions, data, weights, threshold2, model, errors)
            lost = max(
                lost, wald(max(share_of_sample, FEWEST), bad_agree / bad_rows, sizes[SOLVE_COST], test)
            )
            needed = enough_trials(errors, threshold2, m, confidence, lost, growing)
            needed = 0.0 if most == n else needed
    told[0], told[1], told[2] = trial, best, most
    if not best < math.inf:
        return NONE_FOUND
    errors_of(functions[1], data, weights, model, errors)
    if most == n:
        return AGREED
    return CONFIDENT if trial >= needed else BUDGET
