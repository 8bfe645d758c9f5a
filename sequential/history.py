"""What every estimator returns: a history as arrays with a leading N, and a report of the solve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.log import nanoseconds
from sequential.manifold import Manifold, Product

__all__ = ["Innovations", "ModeHistory", "ParticleHistory", "Prediction", "Report", "Run"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Innovations:
    """Readings of one sensor beside what was expected of them.

    For a filter: predicted from the past alone.  For a smoother: predicted from all *other* readings
    (leave-one-out, in closed form), so that in both cases `nis` is χ² with m degrees of freedom.
    """

    t: Ints  # (M,) ns
    row: Ints  # (M,) row in the stream
    residual: Array  # (M, m) measured minus expected, in the tangent of the measurement; NaN where missing
    cov: Array  # (M, m, m) covariance of the residual; a missing component has a unit variance of its own
    accepted: NDArray[np.bool_]  # (M,) False where a gate rejected the reading
    kind: str = "filter"  # or "leave-one-out"

    def nis(self) -> Array:
        """(M,) normalised innovation squared, rᵀ S⁻¹ r, of every reading, gated or not: χ² with `dof()`."""
        present = np.nan_to_num(self.residual)
        solved = np.linalg.solve(self.cov, present[..., None])[..., 0]
        squared: Array = np.einsum("ni,ni->n", present, solved)
        return squared

    def dof(self) -> Ints:
        """(M,) components that each reading has; fewer than m where some are missing."""
        count: Ints = np.isfinite(self.residual).sum(axis=1)
        return count

    def whitened(self) -> Array:
        """(M, m) residuals times the inverse Cholesky factor of their covariance; NaN where missing."""
        lower = np.linalg.cholesky(self.cov)
        white = np.linalg.solve(lower, np.nan_to_num(self.residual)[..., None])[..., 0]
        return np.where(np.isnan(self.residual), np.nan, white)


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Belief at each node before its readings, and the Jacobian of the way there from the node before."""

    mean: Array  # (N, n)
    cov: Array  # (N, d, d)
    transition: Array  # (N, d, d); entry 0 is the identity


@dataclass(frozen=True, slots=True)
class Report:
    """How a solve went; failure is data as well."""

    estimator: str
    converged: bool = True
    iterations: int = 1
    seconds: float = 0.0
    cost: float = float("nan")  # half the sum of squared whitened residuals, where the estimator has one
    message: str = ""
    rejected: int = 0  # by gates
    missing: int = 0  # readings that were NaN throughout
    details: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class ModeHistory:
    """Several models of one system side by side, beside the combined estimate of a `Run`."""

    probability: Array  # (N, J) of each model being in force; rows add up to one
    mean: Array  # (J, N, n) what each model believes
    cov: Array  # (J, N, d, d)

    def __post_init__(self) -> None:
        for values in (self.probability, self.mean, self.cov):
            values.flags.writeable = False

    def likeliest(self) -> Ints:
        """(N,) index of the likeliest model."""
        best: Ints = self.probability.argmax(axis=1)
        return best


@dataclass(frozen=True, slots=True, eq=False)
class ParticleHistory:
    """How well particles covered the belief, and, where they were kept, the particles themselves."""

    effective: Array  # (N,) effective sample size 1 / Σ w², before resampling
    states: Array | None = None  # (N, P, n)
    weights: Array | None = None  # (N, P)

    def __post_init__(self) -> None:
        for values in (self.effective, self.states, self.weights):
            if values is not None:
                values.flags.writeable = False


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Estimates at the nodes of a problem.

    `cov` is in the tangent at `mean` (the chart of `manifold`, which is GTSAM's).
    """

    t: Ints  # (N,) ns
    mean: Array  # (N, n)
    cov: Array  # (N, d, d)
    manifold: Manifold
    innovations: Mapping[str, Innovations]
    log_likelihood: float
    report: Report
    predicted: Prediction | None = None
    modes: ModeHistory | None = None  # of an estimator that mixes models
    particles: ParticleHistory | None = None  # of an estimator that carries particles

    def __post_init__(self) -> None:
        for values in (self.t, self.mean, self.cov):
            values.flags.writeable = False

    def __len__(self) -> int:
        return len(self.t)

    def index(self, t: NDArray[np.generic]) -> Ints:
        """Rows of the nodes at the given times; raises `DataError` where there is none."""
        wanted = np.atleast_1d(nanoseconds(t))
        rows = np.clip(np.searchsorted(self.t, wanted), 0, len(self.t) - 1)
        missing = np.flatnonzero(self.t[rows] != wanted)
        if len(missing):
            msg = (
                f"no estimate at {wanted[missing[0]] * 1e-9:.6f} s (and {len(missing) - 1} more times); "
                "ask for them with run(…, at=times)"
            )
            raise DataError(msg)
        return rows

    def part(self, name: str) -> Array:
        """(N, size) one named part of a product state."""
        if not isinstance(self.manifold, Product):
            raise DataError(f"the state is {self.manifold}, which has no named parts such as {name!r}")
        return self.mean[:, self.manifold.storage(name)]

    def sigmas(self) -> Array:
        """(N, d) standard deviations along the tangent directions."""
        return np.sqrt(np.diagonal(self.cov, axis1=1, axis2=2))
