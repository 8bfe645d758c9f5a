"""One variable from several measurements, none of which determines it alone.

A point seen by one camera lies somewhere on a ray, a beacon heard once on a circle.  From places along them
(`candidates`) a damped Gauss-Newton goes downhill over all measurements, and the best end is taken if it
stands:

- no other end fits nearly as well (a beacon heard along a straight path may be on either side), and
- the errors are nearly linear over the variable's own uncertainty: there a Gaussian, and with it any filter
  or graph, says the truth about it.  For points this asks for parallax without naming an angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import Manifold
from sequential.slam.candidates import candidates
from sequential.slam.factor_model import FactorModel

__all__ = ["Reading", "Several", "determined"]

Array = NDArray[np.float64]
MAX_STEPS = 15
SAME = 1.0  # ends nearer than this many standard deviations are one


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """Measurements (N) of one variable: values (N, n) of the others and None in its place, cov (N, m, m)."""

    model: FactorModel
    missing: int
    z: Array
    values: tuple[Array | None, ...]
    cov: Array


@dataclass(frozen=True, slots=True)
class Several:
    """When several measurements determine a variable well enough to begin it.

    Parameters
    ----------
    at_least : this many measurements
    at_most : no more than this many are asked, the first, the last, and others evenly between them
    bend : how far the errors may depart from linear two standard deviations away, as a share of what the
        linear ones are there; 0.2 asks for a depth known to about a tenth
    margin : how much better (in χ²) the best place must fit than any other
    noise_scale : factor on the measurements' standard deviations, for what else is uncertain: the poses that
        they were made from
    """

    at_least: int = 2
    at_most: int = 16
    bend: float = 0.2
    margin: float = 9.0
    noise_scale: float = 1.0


def determined(manifold: Manifold, readings: Sequence[Reading], several: Several) -> Array | None:
    """The variable (size,), or None where it is not well determined yet."""
    if sum(len(reading.z) for reading in readings) < several.at_least:
        return None
    starts = _candidates(readings)
    ends, cost = _descend(manifold, readings, starts, several.noise_scale)
    if not len(ends):
        return None
    best = int(np.argmin(cost))
    errors, jacobian = _linear(readings, ends[best : best + 1], several.noise_scale)
    left = max(errors.shape[1] - manifold.dim, 1)
    # Where the fit is worse than the noise says, the uncertainty is larger than it says.
    scale = max(1.0, cost[best] / left)
    information = (jacobian[0].T @ jacobian[0]) / scale
    width, axes = np.linalg.eigh(information)
    if width[0] <= 1e-12 * width[-1]:
        return None
    away = manifold.local(ends[best], ends)
    others = np.einsum("ci,ij,cj->c", away, information, away) > SAME**2
    if (cost[others] < cost[best] + several.margin * scale).any():
        return None
    longest = axes[:, 0] * 2.0 / np.sqrt(width[0])
    if _bend(manifold, readings, ends[best], longest, several.noise_scale) > several.bend:
        return None
    return np.asarray(ends[best])


def _candidates(readings: Sequence[Reading]) -> Array:
    """Places that the first and the last measurement allow: (C, size)."""
    found = []
    for reading, at in ((readings[0], 0), (readings[-1], -1)):
        values = [None if value is None else value[at][None] for value in reading.values]
        found.append(candidates(reading.model, reading.missing, reading.z[at][None], *values))
    return np.concatenate(found)


def _linear(readings: Sequence[Reading], x: Array, noise_scale: float) -> tuple[Array, Array]:
    """Whitened errors (C, m) and Jacobians (C, m, d) of all readings at the places x (C, size)."""
    errors, jacobians = [], []
    for reading in readings:
        c, n = len(x), len(reading.z)
        values = [
            np.repeat(x, n, axis=0) if value is None else np.tile(value, (c, 1)) for value in reading.values
        ]
        z, root = np.tile(reading.z, (c, 1)), np.linalg.inv(np.linalg.cholesky(reading.cov)) / noise_scale
        with np.errstate(all="ignore"):
            e = reading.model.errors(z, *values).reshape(c, n, -1)
            J = reading.model.jacobians(z, *values)[reading.missing].reshape(c, n, e.shape[2], -1)
            errors.append(np.einsum("nij,cnj->cni", root, e).reshape(c, -1))
            jacobians.append((root @ J).reshape(c, -1, J.shape[-1]))
    return np.concatenate(errors, axis=1), np.concatenate(jacobians, axis=1)


def _descend(
    manifold: Manifold, readings: Sequence[Reading], x: Array, noise_scale: float
) -> tuple[Array, Array]:
    """Levenberg-Marquardt from every start: the ends (C, size) that are possible, and their χ² (C,)."""
    errors, jacobian = _linear(readings, x, noise_scale)
    cost = _cost(errors)
    alive = np.isfinite(cost)
    x, cost, errors, jacobian = x[alive], cost[alive], errors[alive], jacobian[alive]
    damping, eye = np.full(len(x), 1e-3), np.eye(manifold.dim)
    for _ in range(MAX_STEPS if len(x) else 0):
        hessian = np.swapaxes(jacobian, 1, 2) @ jacobian
        size = np.einsum("cii->ci", hessian).max(axis=1) + np.finfo(np.float64).tiny
        gradient = np.einsum("cmd,cm->cd", jacobian, errors)
        damped = hessian + (damping * size)[:, None, None] * eye
        tried = manifold.retract(x, -np.linalg.solve(damped, gradient[..., None])[..., 0])
        new_errors, new_jacobian = _linear(readings, tried, noise_scale)
        new_cost = _cost(new_errors)
        better = new_cost <= cost
        settled = better & (
            np.subtract(cost, new_cost, out=np.zeros_like(cost), where=better) <= 1e-9 * (1.0 + cost)
        )
        x = np.where(better[:, None], tried, x)
        errors = np.where(better[:, None], new_errors, errors)
        jacobian = np.where(better[:, None, None], new_jacobian, jacobian)
        cost = np.where(better, new_cost, cost)
        damping = np.where(better, np.maximum(damping * 0.1, 1e-12), np.minimum(damping * 10.0, 1e6))
        if settled.all():
            break
    return x, cost


def _cost(errors: Array) -> Array:
    """χ² (C,), infinite where a measurement is impossible, as of a point behind the camera."""
    total = np.einsum("cm,cm->c", errors, errors)
    return np.where(np.isfinite(total), total, np.inf)


def _bend(
    manifold: Manifold, readings: Sequence[Reading], x: Array, step: Array, noise_scale: float
) -> float:
    """How far from linear the errors are a step away on both sides, relative to the linear change."""
    ends = np.stack([manifold.retract(x, side * step) for side in (0.0, 1.0, -1.0)])
    errors, jacobian = _linear(readings, ends, noise_scale)
    if not np.isfinite(errors).all():
        return float("inf")
    linear = jacobian[0] @ step
    worst = max(
        float(np.linalg.norm(errors[i] - errors[0] - side * linear)) for i, side in ((1, 1.0), (2, -1.0))
    )
    return worst / float(np.linalg.norm(linear))
