"""Distance to an ellipsoid, made least in the presence of noise and outliers: |A (m - b)| = 1.

A reading with noise n of covariance S reads too long by (tr ASA - u'ASAu) / 2 on the average, u its
direction, and its noise enters the derivative as well: plain least squares shrinks an ellipsoid the more, the
more noise there is.  Here the mean excess is taken off the residual, and the derivative is evaluated at the
foot of the reading on the ellipsoid, which leaves errors of fourth order in noise over radius.  Outliers get
no weight (Tukey's biweight).  The covariance is the sandwich of M-estimation over blocks of consecutive
readings, so that neighbours may be correlated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotConvergedError
from sequential.sensors.ellipsoid_moments import Ellipsoid, ellipsoid_from_moments, sphere_from_moments

__all__ = ["EllipsoidFit", "excess", "fit_ellipsoid", "parameters_of", "symmetric_index"]

Array = NDArray[np.float64]
Through = Callable[[Array, Array], Ellipsoid | None]
BIWEIGHT = 4.685  # 95 % efficient where there is no outlier
TO_SIGMA = 1.482602218505602  # of a median absolute deviation
STEPS, FULL_STEPS = 60, 15
SETTLED, NEARLY = 1e-7, 1e-3  # of a standard deviation
EXACT = 1e-11  # of a gain, of a radius: where there is no noise
LOOSE = 0.02  # relative standard deviation of a gain that the points hardly know
BLOCKS, LONG_BLOCKS, WANDERS = 200, 20, 1.4
SUBSETS, SUBSET = 80, 25
NEAR = 0.9  # median distance over noise (0.67 without outliers) at which none need be looked for


@dataclass(frozen=True, slots=True, eq=False)
class EllipsoidFit:
    """The ellipsoid |root (m - centre)| = 1 in d = 2 or 3 dimensions.

    Parameters
    ----------
    root : (d, d) symmetric positive definite
    centre : (d,)
    cov : (p, p) of the entries of `root` in the order of `symmetric_index`, then of `centre`
    residuals : (N,) norm minus one, mean excess by noise taken off
    weights : (N,) of the biweight, 0 for an outlier
    sigma : robust standard deviation of the residuals
    expected : what the noise alone would make of it (rms)
    """

    root: Array
    centre: Array
    cov: Array
    residuals: Array
    weights: Array
    sigma: float
    expected: float


def symmetric_index(dim: int) -> list[tuple[int, int]]:
    """Entries of a symmetric matrix that are parameters: the diagonal, then above it, row by row."""
    return [(k, k) for k in range(dim)] + list(combinations(range(dim), 2))


def parameters_of(root: Array, centre: Array) -> Array:
    """(p,) entries of `root` and `centre` in one vector."""
    return np.array([*(root[i, j] for i, j in symmetric_index(len(centre))), *centre])


def excess(vectors: Array, noise_cov: Array) -> tuple[Array, Array]:
    """What noise of this covariance adds to the norms of vectors (N, d): mean (N,) and variance (N,)."""
    norm = np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)
    unit = vectors / norm[:, None]
    along = np.einsum("ni,ij,nj->n", unit, noise_cov, unit)
    return (np.trace(noise_cov) - along) / (2 * norm), along


def fit_ellipsoid(
    points: Array, noise_cov: Array, rng: np.random.Generator, *, sphere: bool = False
) -> EllipsoidFit | None:
    """Robust fit to points (N, d); None where no ellipsoid goes through them.

    Parameters
    ----------
    noise_cov : (d, d) of a single reading
    rng : draws the subsets among which a start without outliers is looked for
    sphere : one radius in all directions: the centre alone is looked for

    Raises
    ------
    NotConvergedError
    """
    through = sphere_from_moments if sphere else ellipsoid_from_moments
    start = _start(points, noise_cov, rng, through)
    if start is None:
        return None
    root, centre = start
    step = scale = np.ones(1)
    free = _free(len(centre), sphere=sphere)
    for k in range(STEPS):
        try:
            step, scale = _step(points, noise_cov, root, centre, free)
        except np.linalg.LinAlgError:
            return None
        root, centre = _moved(root, centre, free @ (step if k < FULL_STEPS else step / 2))
        if np.linalg.eigvalsh(root)[0] <= 0:
            return None
        if (np.abs(step) < np.maximum(SETTLED * scale, EXACT * _reach(root, free))).all():
            return _finished(points, noise_cov, root, centre, free)
    if np.abs(step / scale).max() < NEARLY:
        return _finished(points, noise_cov, root, centre, free)
    if (scale / _reach(root, free)).max() > LOOSE:
        return None
    raise NotConvergedError(
        f"the ellipsoid had not settled after {STEPS} steps: readings of several fields are mixed; record "
        "the turns again, away from iron"
    )


def _start(points: Array, noise_cov: Array, rng: np.random.Generator, through: Through) -> Ellipsoid | None:
    """From the moments of all points, unless most points are nearer to the ellipsoid of a small subset."""
    count = len(points)
    some = points[:: max(1, count // 2000)]
    found = through(points, noise_cov)
    best = np.inf if found is None else _middle_distance(some, found)
    if count < 2 * SUBSET or best < NEAR * float(np.sqrt(np.linalg.eigvalsh(noise_cov)[0])):
        return found
    for _ in range(SUBSETS):
        candidate = through(points[rng.choice(count, SUBSET, replace=False)], noise_cov)
        if candidate is not None and (distance := _middle_distance(some, candidate)) < best:
            best, found = distance, candidate
    return None if found is None else _concentrated(points, noise_cov, found, through)


def _distances(points: Array, ellipsoid: Ellipsoid) -> Array:
    """(N,) from the surface along its normal, to first order, in the unit of the points."""
    root, centre = ellipsoid
    vectors = (points - centre) @ root
    norm = np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)
    return np.asarray(np.abs(norm - 1) * norm / np.linalg.norm(vectors @ root, axis=1))


def _middle_distance(points: Array, ellipsoid: Ellipsoid) -> float:
    return float(np.median(_distances(points, ellipsoid)))


def _concentrated(points: Array, noise_cov: Array, found: Ellipsoid, through: Through) -> Ellipsoid:
    """From the moments of the points that are near, twice (the concentration step of Rousseeuw)."""
    for _ in range(2):
        distances = _distances(points, found)
        near = points[distances <= 3 * TO_SIGMA * np.median(distances)]
        better = through(near, noise_cov)
        if better is None or _middle_distance(points, better) > 1.2 * np.median(distances):
            break
        found = better
    return found


def _weighed(points: Array, noise_cov: Array, root: Array, centre: Array) -> tuple[Array, ...]:
    """Residuals (N,), derivatives (N, p), weights (N,) and standard deviations (N,)."""
    arm = points - centre
    vectors = arm @ root
    noise = root @ noise_cov @ root
    too_long, along = excess(vectors, noise)
    norm = np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)
    unit = vectors / norm[:, None]
    residuals = norm - 1 - too_long
    foot = arm if not along.min() > 0 else arm - (residuals / along)[:, None] * (unit @ root @ noise_cov)
    # the weight too is that of the foot, or it would go with the noise that it weighs
    _, along = excess(foot @ root, noise)
    # scatter that the sensor's noise does not explain is the same in every direction
    spread = TO_SIGMA * float(np.median(np.abs(residuals)))
    sigma = np.sqrt(along + max(0.0, spread**2 - float(np.median(along))) + 1e-24)
    ratio = np.abs(residuals) / (BIWEIGHT * sigma)
    biweight = np.where(ratio < 1, (1 - ratio**2) ** 2, 0.0)
    return residuals, _derivative(foot, root), biweight, sigma


def _derivative(arm: Array, root: Array) -> Array:
    """(N, p) of |root arm| by the parameters."""
    vectors = arm @ root
    unit = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)[:, None]
    columns = [
        unit[:, i] * arm[:, j] + (unit[:, j] * arm[:, i] if i != j else 0.0)
        for i, j in symmetric_index(len(root))
    ]
    return np.column_stack([*columns, -unit @ root])


def _step(points: Array, noise_cov: Array, root: Array, centre: Array, free: Array) -> tuple[Array, Array]:
    """Gauss-Newton step (p,) and the standard deviation of each parameter."""
    residuals, derivative, biweight, sigma = _weighed(points, noise_cov, root, centre)
    derivative = derivative @ free
    weighed = derivative * (biweight / sigma**2)[:, None]
    information = weighed.T @ derivative
    scale = 1 / np.sqrt(np.diag(information))
    scaled = information * np.outer(scale, scale)
    step = -scale * np.linalg.solve(scaled, scale * (weighed.T @ residuals))
    step = np.clip(step, -0.5 * _reach(root, free), 0.5 * _reach(root, free))
    return step, np.asarray(scale)


def _free(dim: int, *, sphere: bool) -> Array:
    """(p, q) parameters by those that are fitted: all of them, or one gain and the centre."""
    gains = dim * (dim + 1) // 2
    if not sphere:
        return np.eye(gains + dim)
    free = np.zeros((gains + dim, 1 + dim))
    free[:dim, 0], free[gains:, 1:] = 1.0, np.eye(dim)
    return free


def _reach(root: Array, free: Array) -> Array:
    """(q,) sizes that a step should not exceed: of the gains, and of the radius."""
    dim = len(root)
    gain = np.trace(root) / dim
    reach = np.concatenate([np.full(dim * (dim + 1) // 2, gain), np.full(dim, 1 / gain)])
    return np.asarray((free * reach[:, None]).max(axis=0))


def _moved(root: Array, centre: Array, step: Array) -> Ellipsoid:
    moved = root.copy()
    index = symmetric_index(len(root))
    for value, (i, j) in zip(step, index, strict=False):
        moved[i, j] += value
        if i != j:
            moved[j, i] += value
    shifted: Array = centre + step[len(index) :]
    return moved, shifted


def _score_cov(score: Array) -> Array:
    """Covariance (p, p) of the sum of the scores (N, p), from sums over blocks of neighbours.

    A field that changes over minutes shows in blocks so long that few are left; they scatter too much to
    stand for every parameter, and raise the whole covariance where they agree that it is too small.
    """
    short, long = (_block_cov(score, count) for count in (BLOCKS, LONG_BLOCKS))
    ratio = float(np.mean(np.diag(long) / np.maximum(np.diag(short), 1e-300)))
    return short * ratio if len(score) > 2 * BLOCKS and ratio > WANDERS else short


def _block_cov(score: Array, count: int) -> Array:
    sums = np.add.reduceat(score, np.arange(0, len(score), max(1, len(score) // count)), axis=0)
    return np.asarray(len(sums) / max(1, len(sums) - 1) * sums.T @ sums)


def _finished(points: Array, noise_cov: Array, root: Array, centre: Array, free: Array) -> EllipsoidFit:
    residuals, derivative, biweight, sigma = _weighed(points, noise_cov, root, centre)
    derivative = derivative @ free
    score = derivative * (biweight / sigma**2 * residuals)[:, None]
    ratio2 = (residuals / (BIWEIGHT * sigma)) ** 2
    slope = np.where(ratio2 < 1, (1 - ratio2) * (1 - 5 * ratio2), 0.0)  # derivative of the biweight's score
    bread = (derivative * (slope / sigma**2)[:, None]).T @ derivative
    scale = 1 / np.sqrt(np.abs(np.diag(bread)))
    inverse = np.linalg.inv(bread * np.outer(scale, scale)) * np.outer(scale, scale)
    cov = free @ inverse @ _score_cov(score) @ inverse @ free.T
    _, along = excess((points - centre) @ root, root @ noise_cov @ root)
    return EllipsoidFit(
        root,
        centre,
        (cov + cov.T) / 2,
        residuals,
        biweight,
        TO_SIGMA * float(np.median(np.abs(residuals))),
        float(np.sqrt(along.mean())),
    )
