"""Does an estimator know how wrong it is?  Squared errors in units of their own covariance, held to χ²."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import NotPositiveDefiniteError, ShapeError
from sequential.history import Innovations, Run
from sequential.manifold import Manifold, Product

__all__ = [
    "AverageNees",
    "Consistency",
    "anees",
    "chi2_band",
    "chi2_quantile",
    "nees",
    "nis_summary",
    "normalised_error",
    "summarise",
    "whole_nis",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

TAIL = 0.95  # the χ² quantile beyond which a value counts as tail; 1 - TAIL of the values are expected there


def chi2_quantile(probability: float, dof: float) -> float:
    """The value that a χ² variable with `dof` degrees of freedom stays below with this probability."""
    from scipy.special import chdtri

    return float(chdtri(dof, 1.0 - probability))


def chi2_band(dof: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Two-sided band of the mean of `n` independent χ² values of `dof` degrees of freedom each.

    n times the mean is χ² with n·dof degrees of freedom (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2).

    Raises
    ------
    ShapeError
        if there is no value to average, or `level` is not between 0 and 1.
    """
    if dof < 1 or n < 1 or not 0.0 < level < 1.0:
        raise ShapeError(f"a χ² band needs dof >= 1, n >= 1 and 0 < level < 1; got {dof}, {n}, {level}")
    beyond = (1.0 - level) / 2.0
    return chi2_quantile(beyond, n * dof) / n, chi2_quantile(1.0 - beyond, n * dof) / n


@dataclass(frozen=True, slots=True)
class Consistency:
    """Normalised squared values beside what χ² expects of them.

    `tail_share` is the share of values above the 0.95 quantile of χ² (0.05 expected); `count` is the number
    of values in the mean, so without the gated ones, whose share is `fraction_gated`.
    """

    mean: float
    median: float
    expected: float
    band: tuple[float, float]
    inside_band: bool
    tail_share: float
    fraction_gated: float
    count: int
    dof: int
    kind: str

    @property
    def expected_median(self) -> float:
        """Median of χ² with `dof` degrees of freedom."""
        return chi2_quantile(0.5, self.dof)

    @property
    def factor(self) -> float:
        """Factor on all standard deviations that would bring the mean to what is expected."""
        return float(np.sqrt(self.mean / self.expected))

    @property
    def verdict(self) -> str:
        """`consistent`, `overconfident` (errors larger than claimed), `pessimistic` or `no data`."""
        if not self.count:
            return "no data"
        if self.inside_band:
            return "consistent"
        return "overconfident" if self.mean > self.expected else "pessimistic"


def summarise(values: ArrayLike, dof: int, kind: str, gated: int = 0, level: float = 0.95) -> Consistency:
    """Hold normalised squared values (N,) to χ² with `dof` degrees of freedom.

    Parameters
    ----------
    gated : how many further values were rejected before the estimator used them

    Notes
    -----
    The band is that of independent values; correlated ones (several held-out fixes between two used
    ones, leave-one-out residuals) scatter more: see `block_bootstrap` for theirs.
    """
    own = np.asarray(values, dtype=np.float64)
    if not own.size:
        share = 1.0 if gated else 0.0
        return Consistency(np.nan, np.nan, dof, (np.nan, np.nan), False, np.nan, share, 0, dof, kind)  # noqa: FBT003
    band = chi2_band(dof, own.size, level)
    mean = float(own.mean())
    return Consistency(
        mean=mean,
        median=float(np.median(own)),
        expected=float(dof),
        band=band,
        inside_band=band[0] <= mean <= band[1],
        tail_share=float(np.mean(own > chi2_quantile(TAIL, dof))),
        fraction_gated=gated / (own.size + gated),
        count=int(own.size),
        dof=dof,
        kind=kind,
    )


def whole_nis(innovations: Innovations) -> Array:
    """(M,) NIS of all readings, χ² with m degrees of freedom also where components are missing.

    The value of a partial reading is exchanged for the one that is as improbable with m degrees of freedom.
    """
    if not len(innovations.t):
        return np.zeros(0)
    from scipy.special import chdtrc, chdtri

    nis, dof, m = innovations.nis(), innovations.dof(), innovations.residual.shape[1]
    partial = np.flatnonzero(dof < m)
    beyond = chdtrc(dof[partial], nis[partial])
    # so improbable that its probability underflows: scaled, which is as far outside
    nis[partial] = np.where(
        beyond > 0.0, chdtri(m, np.maximum(beyond, 1e-300)), nis[partial] * m / np.maximum(dof[partial], 1)
    )
    return nis


def nis_summary(innovations: Innovations) -> Consistency:
    """Summarise the normalised innovations squared of one sensor: accepted readings, gated ones counted."""
    nis = whole_nis(innovations)[innovations.accepted]
    gated = int(np.count_nonzero(~innovations.accepted))
    return summarise(nis, innovations.residual.shape[1], innovations.kind, gated)


def nees(
    run: Run, truth_mean: ArrayLike, *, part: str | ArrayLike | None = None, rows: Ints | None = None
) -> Array:
    """Normalised estimation error squared at each node: eᵀ P⁻¹ e with e = local(mean, truth).

    Parameters
    ----------
    truth_mean : (N, n) true states; where `part` is a name, (N, size of the part) will do
    part : name of a part of a product state, or the tangent directions (k,) to look at; all by default
    rows : nodes of the run that the truth belongs to, as from `run.index(t)`; all by default

    Returns
    -------
    Array
        (N,) values, χ² with as many degrees of freedom as there are directions.

    Raises
    ------
    ShapeError, NotPositiveDefiniteError
    """
    mean, cov = (run.mean, run.cov) if rows is None else (run.mean[rows], run.cov[rows])
    truth = np.atleast_2d(np.asarray(truth_mean, dtype=np.float64))
    error, directions = _error(run.manifold, mean, truth, part)
    return _squared(error, cov[:, directions[:, None], directions[None, :]], "the covariance of the run")


def _error(manifold: Manifold, mean: Array, truth: Array, part: str | ArrayLike | None) -> tuple[Array, Ints]:
    """The error (N, k) along tangent directions, and which directions (k,) of the whole they are."""
    member, storage, tangent = manifold, slice(0, manifold.size), slice(0, manifold.dim)
    if isinstance(part, str):
        if not isinstance(manifold, Product):
            raise ShapeError(f"the state has no part {part!r}, it is {manifold!r}; leave part=… out")
        member, storage, tangent = manifold.part(part), manifold.storage(part), manifold.tangent(part)
        if truth.shape[1] == manifold.size:
            truth = truth[:, storage]
    if truth.shape != (len(mean), member.size):
        raise ShapeError(
            f"the truth must have shape ({len(mean)}, {member.size}), one row for each estimate, "
            f"got {truth.shape}"
        )
    error = member.local(mean[:, storage], truth)
    every = np.arange(tangent.start, tangent.stop)
    if part is None or isinstance(part, str):
        return error, every
    chosen = np.asarray(part)
    chosen = np.flatnonzero(chosen) if chosen.dtype == np.bool_ else chosen.astype(np.int64)
    return error[:, chosen], every[chosen]


def normalised_error(estimate: ArrayLike, cov: ArrayLike, measured: ArrayLike, noise_cov: ArrayLike) -> Array:
    """Squared distance (N,) between estimates and independent measurements, in units of both covariances.

    Parameters
    ----------
    estimate, measured : (N, m)
    cov : (N, m, m) covariance of the estimates, in the frame of the measurements
    noise_cov : (m, m) or (N, m, m) noise of the measurements; 0 for a truth without noise
    """
    error = np.asarray(measured, dtype=np.float64) - np.asarray(estimate, dtype=np.float64)
    total = np.asarray(cov, dtype=np.float64) + np.asarray(noise_cov, dtype=np.float64)
    n, m = error.shape if error.ndim == 2 else (0, 0)
    if error.ndim != 2 or total.shape != (n, m, m):
        raise ShapeError(f"errors (N, m) need covariances (N, m, m); got {error.shape} and {total.shape}")
    return _squared(error, total, "the covariance of the estimate")


def _squared(error: Array, cov: Array, where: str) -> Array:
    try:
        lower = np.linalg.cholesky(cov)
    except np.linalg.LinAlgError as fault:
        raise NotPositiveDefiniteError(
            f"{where} is not positive definite at some node, so errors cannot be measured in its units; "
            "leave out directions that are known exactly"
        ) from fault
    white = np.linalg.solve(lower, error[..., None])[..., 0]
    return np.asarray(np.einsum("ni,ni->n", white, white))


@dataclass(frozen=True, slots=True, eq=False)
class AverageNees:
    """NEES averaged over repeated runs: `average` (N,) node by node, inside `band` for 95 % of the nodes."""

    average: Array
    band: tuple[float, float]
    share_inside: float
    mean: float
    runs: int
    dof: int


def anees(values: Sequence[ArrayLike], dof: int, level: float = 0.95) -> AverageNees:
    """Average the NEES of Monte Carlo runs, each (N,), with the band for that many runs.

    Raises
    ------
    ShapeError
        if the runs do not have the same number of nodes.
    """
    lengths = {np.shape(v) for v in values}
    if len(lengths) != 1 or len(next(iter(lengths))) != 1:
        raise ShapeError(f"ANEES needs runs of one length, each (N,); got shapes {sorted(lengths)}")
    average = np.mean(np.stack([np.asarray(v, dtype=np.float64) for v in values]), axis=0)
    band = chi2_band(dof, len(values), level)
    inside = float(np.mean((average >= band[0]) & (average <= band[1])))
    return AverageNees(average, band, inside, float(average.mean()), len(values), dof)
