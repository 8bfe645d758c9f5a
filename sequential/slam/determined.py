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
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import Manifold
from sequential.slam.candidates import candidates
from sequential.slam.factor_model import FactorModel

__all__ = ["Reading", "Several", "determined"]

Array = NDArray[np.float64]
MAX_STEPS = 12
DESCENTS = 4  # the starts that fit best
SETTLED, STUCK = 1e-6, 1e3  # share of (1 + χ²) that a last step gains; damping at which no step helps
HOPELESS = 5.0  # a bend this many times too large before the descent will not be mended by it
FREE = 1e-12  # share of the largest information below which a direction is not measured at all
SAME = 1.0  # ends nearer than this many standard deviations are one


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """Measurements (N) of one variable: values (N, n) of the others and None in its place, cov (N, m, m).

    `drift` are covariances (N, d, d) of the other variables relative to one of them, where these are only as
    good as dead reckoning; None where that does not matter.
    """

    model: FactorModel
    missing: int
    z: Array
    values: tuple[Array | None, ...]
    cov: Array
    drift: tuple[Array | None, ...] = ()


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
    fit = _Fit(manifold, tuple(readings), several.noise_scale)
    starts = fit.best(_candidates(readings))
    if len(starts) and any(cov is not None for reading in readings for cov in reading.drift):
        fit = _Fit(manifold, tuple(_drifted(reading, starts[0]) for reading in readings), several.noise_scale)
    if not len(starts) or fit.bend(starts[0], fit.longest(starts[0], 1.0)) > HOPELESS * several.bend:
        return None
    ends, cost = fit.descend(starts)
    best = int(np.argmin(cost))
    end = np.asarray(ends[best])
    # Where the fit is worse than the noise says, the uncertainty is larger than it says.
    scale = max(1.0, cost[best] / max(fit.count - manifold.dim, 1))
    information = fit.information(end) / scale
    away = manifold.local(end, ends)
    others = np.einsum("ci,ij,cj->c", away, information, away) > SAME**2
    if (cost[others] < cost[best] + several.margin * scale).any():
        return None
    return None if fit.bend(end, fit.longest(end, scale)) > several.bend else end


def _candidates(readings: Sequence[Reading]) -> Array:
    """Places that the first and the last measurement allow: (C, size)."""
    found = []
    for reading, at in ((readings[0], 0), (readings[-1], -1)):
        values = [None if value is None else value[at][None] for value in reading.values]
        found.append(candidates(reading.model, reading.missing, reading.z[at][None], *values))
    return np.concatenate(found)


def _drifted(reading: Reading, x: Array) -> Reading:
    """The reading with the noise that drift adds to it, as it is for the variable at x (size,)."""
    here = np.repeat(x[None], len(reading.z), axis=0)
    values = [here if value is None else value for value in reading.values]
    jacobians = reading.model.jacobians(reading.z, *values)
    cov = reading.cov
    for J, drift in zip(jacobians, reading.drift, strict=False):
        if drift is not None:
            cov = cov + J @ drift @ np.swapaxes(J, 1, 2)
    return replace(reading, cov=cov, drift=())


@dataclass(frozen=True, slots=True)
class _Fit:
    """Least squares for one variable; x (C, size) are places to try."""

    manifold: Manifold
    readings: tuple[Reading, ...]
    noise_scale: float

    @property
    def count(self) -> int:
        """Numbers that were measured."""
        return sum(len(reading.z) * reading.model.measured.dim for reading in self.readings)

    def linear(self, x: Array) -> tuple[Array, Array]:
        """Whitened errors (C, m) and Jacobians (C, m, d) of all readings."""
        errors, jacobians = [], []
        for reading in self.readings:
            c, n = len(x), len(reading.z)
            here, z = np.repeat(x, n, axis=0), np.tile(reading.z, (c, 1))
            values = [here if value is None else np.tile(value, (c, 1)) for value in reading.values]
            root = np.linalg.inv(np.linalg.cholesky(reading.cov)) / self.noise_scale
            with np.errstate(all="ignore"):
                e = reading.model.errors(z, *values).reshape(c, n, -1)
                J = reading.model.jacobians(z, *values)[reading.missing].reshape(c, n, e.shape[2], -1)
                errors.append(np.einsum("nij,cnj->cni", root, e).reshape(c, -1))
                jacobians.append((root @ J).reshape(c, -1, J.shape[-1]))
        return np.concatenate(errors, axis=1), np.concatenate(jacobians, axis=1)

    def best(self, x: Array) -> Array:
        """The starts that fit best."""
        cost = _cost(self.linear(x)[0]) if len(x) else np.zeros(0)
        first = np.argsort(cost, kind="stable")[:DESCENTS]
        first = first[np.isfinite(cost[first])]
        return x[first]

    def descend(self, x: Array) -> tuple[Array, Array]:
        """Levenberg-Marquardt from every start: the ends (C, size), and their χ² (C,)."""
        errors, jacobian = self.linear(x)
        cost, damping, eye = _cost(errors), np.full(len(x), 1e-3), np.eye(self.manifold.dim)
        for _ in range(MAX_STEPS):
            hessian = np.swapaxes(jacobian, 1, 2) @ jacobian
            size = np.einsum("cii->ci", hessian).max(axis=1) + np.finfo(np.float64).tiny
            gradient = np.einsum("cmd,cm->cd", jacobian, errors)
            damped = hessian + (damping * size)[:, None, None] * eye
            tried = self.manifold.retract(x, -np.linalg.solve(damped, gradient[..., None])[..., 0])
            new_errors, new_jacobian = self.linear(tried)
            new_cost = _cost(new_errors)
            better = new_cost <= cost
            gain = np.subtract(cost, new_cost, out=np.zeros_like(cost), where=better)
            x = np.where(better[:, None], tried, x)
            errors = np.where(better[:, None], new_errors, errors)
            jacobian = np.where(better[:, None, None], new_jacobian, jacobian)
            cost = np.where(better, new_cost, cost)
            damping = np.where(better, np.maximum(damping * 0.1, 1e-12), damping * 10.0)
            if ((better & (gain <= SETTLED * (1.0 + cost))) | (damping > STUCK)).all():
                break
        return x, cost

    def information(self, x: Array) -> Array:
        """(d, d) at one place (size,)."""
        jacobian = self.linear(x[None])[1][0]
        return np.asarray(jacobian.T @ jacobian)

    def longest(self, x: Array, scale: float) -> Array | None:
        """Two standard deviations (d,) along the least certain direction; None where nothing bounds it."""
        width, axes = np.linalg.eigh(self.information(x) / scale)
        return axes[:, 0] * 2.0 / np.sqrt(width[0]) if width[0] > FREE * width[-1] else None

    def bend(self, x: Array, step: Array | None) -> float:
        """How far from linear the errors are a step away on both sides, as a share of the linear change."""
        if step is None:
            return float("inf")
        ends = np.stack([self.manifold.retract(x, side * step) for side in (0.0, 1.0, -1.0)])
        errors, jacobian = self.linear(ends)
        if not np.isfinite(errors).all():
            return float("inf")
        linear = jacobian[0] @ step
        off = [np.linalg.norm(errors[1] - errors[0] - linear), np.linalg.norm(errors[2] - errors[0] + linear)]
        return float(max(off) / np.linalg.norm(linear))


def _cost(errors: Array) -> Array:
    """χ² (C,), infinite where a measurement is impossible."""
    total = np.einsum("cm,cm->c", errors, errors)
    return np.where(np.isfinite(total), total, np.inf)
