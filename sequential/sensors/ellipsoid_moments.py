"""An ellipsoid through noisy points from their moments, corrected for the noise: the start of the fit.

The least squares of a quadric is pulled by the noise of the points, however many they are.  Replacing every
moment by its unbiased estimate makes it consistent: A. Kukush, I. Markovsky and S. Van Huffel, "Consistent
estimation in an implicit quadratic measurement error model", Comput. Stat. Data Anal. 47 (2004), 123-147.
Where the quadric so found is no ellipsoid, the constraint of Q. Li and J. Griffiths, "Least squares ellipsoid
specific fitting", GMP 2004, makes it one.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Ellipsoid", "ellipsoid_from_moments", "sphere_from_moments", "symmetric_root"]

Array = NDArray[np.float64]
Ellipsoid = tuple[Array, Array]  # symmetric A (d, d) and centre b (d,) with |A (m - b)| = 1
ROOM = 1e-9  # smallest over largest eigenvalue of what is still an ellipsoid


def ellipsoid_from_moments(points: Array, noise_cov: Array) -> Ellipsoid | None:
    """Symmetric A (d, d) and centre b (d,), for d = 2 or 3; None where no ellipsoid fits.

    Parameters
    ----------
    points : (N, d)
    noise_cov : (d, d) of the noise of a point, the same for all; zeros for none
    """
    dim = points.shape[1]
    centre = points.mean(axis=0)
    width = float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean()))
    if not width > 0:
        return None
    # in these coordinates the noise is the same and independent on every axis, or nothing
    turn, sigma = _axes_of(noise_cov)
    scaled = (points - centre) @ turn / width
    exponents = _exponents(dim)
    gram = _moments(scaled, (sigma / width) ** 2, exponents)
    for quadric in (_smallest(gram), _ellipsoidal(gram) if dim == 3 else None):
        found = None if quadric is None else _of_quadric(quadric, exponents, dim)
        if found is not None:
            root, middle = found
            return turn @ root @ turn.T / width, centre + width * (turn @ middle)
    return None


def _axes_of(noise_cov: Array) -> tuple[Array, Array]:
    values, vectors = np.linalg.eigh(noise_cov)
    return vectors, np.sqrt(np.clip(values, 0.0, None))


def _exponents(dim: int) -> list[tuple[int, ...]]:
    """Monomials of a quadric: squares, products, linear terms, one."""
    squares = [tuple(2 * (k == i) for k in range(dim)) for i in range(dim)]
    products = [tuple(int(k in pair) for k in range(dim)) for pair in combinations(range(dim), 2)]
    linear = [tuple(int(k == i) for k in range(dim)) for i in range(dim)]
    return [*squares, *products, *linear, (0,) * dim]


def _moments(points: Array, variance: Array, exponents: list[tuple[int, ...]]) -> Array:
    """Gram matrix of the monomials of the points without their noise: Hermite polynomials are unbiased."""
    x, v = points, variance
    power = [np.ones_like(x), x, x**2 - v, x**3 - 3 * x * v, x**4 - 6 * x**2 * v + 3 * v**2]
    gram = np.empty((len(exponents), len(exponents)))
    for i, first in enumerate(exponents):
        for j, second in enumerate(exponents[: i + 1]):
            product = np.ones(len(x))
            for axis, (a, b) in enumerate(zip(first, second, strict=True)):
                if a + b:
                    product = product * power[a + b][:, axis]
            gram[i, j] = gram[j, i] = product.mean()
    return gram


def _smallest(gram: Array) -> Array:
    return np.asarray(np.linalg.eigh(gram)[1][:, 0])


def _ellipsoidal(gram: Array) -> Array | None:
    """Smallest under 4J - I² = 1, which no other quadric than an ellipsoid can meet."""
    constraint = np.zeros((6, 6))
    constraint[:3, :3] = 1 - 2 * np.eye(3)  # 4J - I², over squares; products carry a factor 2 here
    constraint[3:, 3:] = -np.eye(3)
    upper, mixed, lower = gram[:6, :6], gram[:6, 6:], gram[6:, 6:]
    try:
        folded = upper - mixed @ np.linalg.solve(lower, mixed.T)
        values, vectors = np.linalg.eig(np.linalg.solve(constraint, folded))
    except np.linalg.LinAlgError:
        return None
    best = np.real(vectors[:, int(np.argmax(np.real(values)))])
    return np.concatenate([best, -np.linalg.solve(lower, mixed.T @ best)])


def _of_quadric(quadric: Array, exponents: list[tuple[int, ...]], dim: int) -> Ellipsoid | None:
    """A and b of x'Qx + g'x + k = 0; None where Q is not definite or nothing lies on the surface."""
    Q, g, k = np.zeros((dim, dim)), np.zeros(dim), 0.0
    for value, exponent in zip(quadric, exponents, strict=True):
        axes = [axis for axis, power in enumerate(exponent) for _ in range(power)]
        if len(axes) == 2:
            Q[axes[0], axes[1]] += value / 2
            Q[axes[1], axes[0]] += value / 2
        elif axes:
            g[axes[0]] = value
        else:
            k = float(value)
    if np.trace(Q) < 0:
        Q, g, k = -Q, -g, -k
    values = np.linalg.eigvalsh(Q)
    if values[0] <= ROOM * values[-1]:
        return None
    centre = -np.linalg.solve(Q, g) / 2
    level = centre @ Q @ centre - k
    return (symmetric_root(Q / level), centre) if level > 0 else None


def sphere_from_moments(points: Array, noise_cov: Array) -> Ellipsoid | None:
    """The same for one radius in all directions: |m|² is linear in centre and radius."""
    middle = points.mean(axis=0)
    x = points - middle
    square = (x**2).sum(axis=1)
    normal = np.block(
        [[x.T @ x / len(x) - noise_cov, np.zeros((len(middle), 1))], [np.zeros(len(middle)), 1.0]]
    )
    # x is centred, so that what noise adds to the mean of |x|² x vanishes
    right = np.append(square @ x / len(x), square.mean() - np.trace(noise_cov))
    try:
        *twice, level = np.linalg.solve(normal, right)
    except np.linalg.LinAlgError:
        return None
    centre = np.array(twice) / 2
    radius2 = level + centre @ centre
    return (np.eye(len(centre)) / np.sqrt(radius2), middle + centre) if radius2 > 0 else None


def symmetric_root(matrix: Array) -> Array:
    """The symmetric positive definite square root."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.sqrt(values)) @ vectors.T)
