"""Kalman updates in rational arithmetic, and whole filters in a hundred digits."""

from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np


def fractions(values):
    """Nested lists of fractions, equal to the given floats."""
    values = np.asarray(values, dtype=np.float64)
    if values.ndim == 1:
        return [Fraction(float(v)) for v in values]
    return [[Fraction(float(v)) for v in row] for row in values]


def product(a, b):
    return [
        [sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*b, strict=True)] for row in a
    ]


def solve(a, b):
    """Solve a x = b by elimination; both are lists of rows."""
    rows = [list(left) + list(right) for left, right in zip(a, b, strict=True)]
    size = len(a)
    for j in range(size):
        pivot = next(i for i in range(j, size) if rows[i][j] != 0)
        rows[j], rows[pivot] = rows[pivot], rows[j]
        rows[j] = [value / rows[j][j] for value in rows[j]]
        for i in range(size):
            if i != j and rows[i][j] != 0:
                share = rows[i][j]
                rows[i] = [x - share * y for x, y in zip(rows[i], rows[j], strict=True)]
    return [row[size:] for row in rows]


def determinant(a):
    """By elimination without exchanges: every leading minor must differ from zero."""
    rows, value = [list(row) for row in a], Fraction(1)
    for j in range(len(a)):
        value *= rows[j][j]
        for i in range(j + 1, len(a)):
            share = rows[i][j] / rows[j][j]
            rows[i] = [x - share * y for x, y in zip(rows[i], rows[j], strict=True)]
    return value


def update(p, h, noise, residual):
    """P+ (d, d), correction (d,), NIS and det S of one reading; floats in, exact results rounded once."""
    p, h, noise = fractions(p), fractions(h), fractions(noise)
    residual = [[value] for value in fractions(residual)]
    cross = product(h, p)
    s = product(cross, list(map(list, zip(*h, strict=True))))
    s = [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(s, noise, strict=True)]
    gain = solve(s, cross)  # Kᵀ
    weighed = solve(s, residual)
    nis = sum(r[0] * w[0] for r, w in zip(residual, weighed, strict=True))
    across = list(map(list, zip(*cross, strict=True)))
    taken = product(across, gain)
    after = [[x - y for x, y in zip(*rows, strict=True)] for rows in zip(p, taken, strict=True)]
    delta = product(across, weighed)
    return (
        np.array([[float(v) for v in row] for row in after]),
        np.array([float(row[0]) for row in delta]),
        float(nis),
        determinant(s),
    )


def variances(problem, digits=100):
    """(K, d) filtered variances of a model of LinearProcess and one LinearSensor, readings missing or not."""
    model, plan = problem.model, problem.schedule
    sensor = next(iter(model.sensors.values()))
    with localcontext() as context:
        context.prec = digits
        f, q, p = decimals(model.process.F), decimals(model.process.Q), decimals(model.prior.cov)
        found = []
        for node in range(len(problem.t)):
            for _ in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
                p = f.dot(p).dot(f.T) + q
            for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
                there = ~np.isnan(plan.z[reading])
                h, noise = decimals(sensor.matrix[there]), decimals(sensor.noise_cov[np.ix_(there, there)])
                cross = h.dot(p)
                gain = np.array(solve((cross.dot(h.T) + noise).tolist(), cross.tolist()), dtype=object)
                p = p - cross.T.dot(gain)
                p = (p + p.T) / 2
            found.append([float(v) for v in p.diagonal()])
    return np.array(found)


def decimals(values):
    """An array of decimals, equal to the given floats."""
    return np.vectorize(lambda v: Decimal(float(v)), otypes=[object])(np.atleast_2d(values))
