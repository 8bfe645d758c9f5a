"""How good a model is, found out while looking at as few rows as will do; how many samples are enough.

The cost of a model is the sum over rows of min(error², threshold²) (MSAC: Torr, Zisserman 2000, "MLESAC"), of
threshold² for each outlier (plain RANSAC), or the median of the errors² (LMedS: Rousseeuw 1984).
A model is given up early by Wald's sequential test between "good: a share epsilon of the rows agree" and
"bad: a share delta do", taken after each block of rows (Matas, Chum 2005, "Randomized RANSAC with SPRT").
"""

from __future__ import annotations

import math

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import b0, f0, f1, f2, i0, w1
from vision3d.kernels.robust_calls import call, pointer

__all__ = ["errors_of", "median_cost", "score", "select", "trials_needed", "wald"]


@kernel(i0(i0, f2, f1, w1, w1), inline="never")
def errors_of(residuals, data, weights, model, errors):
    """Fill errors (n,): the squared error of each row of data (the first n), by weights (relative 1/σ²)."""
    n = errors.shape[0]
    fine = call(residuals, pointer(data, 0), n, data.shape[1], pointer(model, 0), pointer(errors, 0))
    for i in range(n):
        errors[i] *= weights[i]
    return fine


@kernel(f0(i0, f2, f1, w1, f0, b0, f0, f1, w1, w1), inline="never")
def score(residuals, data, weights, model, threshold2, counting, limit, test, room, told):
    """Cost of a model; infinite once it exceeds `limit`, or when the test gives it up.

    `test` holds what a row that agrees adds to the likelihood of "bad", what one that does not adds, and the
    sum at which to give up; `room` is for a block of errors; `told` hears of rows seen and how many agree.
    """
    n, k = data.shape
    cost, likelihood, seen, agree = 0.0, 0.0, 0, 0
    while seen < n:
        block = min(room.shape[0], n - seen)
        call(residuals, pointer(data, seen * k), block, k, pointer(model, 0), pointer(room, 0))
        hits, over = 0, 0.0
        for j in range(block):
            error = room[j] * weights[seen + j]
            inside = error < threshold2
            hits += 1 if inside else 0
            over += error if inside else threshold2
        cost += (block - hits) * threshold2 if counting else over
        seen += block
        agree += hits
        likelihood += hits * test[0] + (block - hits) * test[1]
        if not cost < limit or (likelihood > test[2] and seen < n):
            cost = math.inf
            break
    told[0], told[1] = seen, agree
    return cost


@inlined
def wald(epsilon, delta, solve_cost, test):
    """Fill test (3,) for shares epsilon and delta, where a sample costs as much as solve_cost rows.

    Returns the probability that a good model is given up, at most.
    """
    if not epsilon > 2.0 * delta:
        test[0], test[1], test[2] = 0.0, 0.0, math.inf
        return 0.0
    share = min(epsilon, 0.999)
    test[0], test[1] = math.log(delta / share), math.log((1.0 - delta) / (1.0 - share))
    gain = (1.0 - delta) * test[1] + delta * test[0]
    first = solve_cost * gain + 1.0
    limit = first
    for _ in range(10):
        limit = first + math.log(limit)
    limit = max(limit, 50.0)
    test[2] = math.log(limit)
    return 1.0 / limit


@inlined
def trials_needed(agree, n, m, confidence, lost):
    """Samples after which one of agreeing rows only was drawn, and not given up, with this confidence."""
    chance = 1.0 - lost
    for i in range(m):
        chance *= max(agree - i, 0) / (n - i)
    if chance >= 1.0:
        return 1.0
    if chance <= 0.0:
        return math.inf
    return math.log(1.0 - confidence) / math.log1p(-chance)


@inlined
def select(values, rank):
    """The value that has this rank (from 0), by Hoare's selection; reorders values."""
    low, high = 0, values.shape[0] - 1
    while low < high:
        middle = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] < middle:
                i += 1
            while values[j] > middle:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return values[rank]


@kernel(f0(i0, f2, f1, w1, w1), inline="never")
def median_cost(residuals, data, weights, model, errors):
    """Median of the squared errors, infinite where one is not a number; errors (n,) is left in disorder."""
    errors_of(residuals, data, weights, model, errors)
    for i in range(errors.shape[0]):
        if math.isnan(errors[i]):
            return math.inf
    return select(errors, errors.shape[0] // 2)
