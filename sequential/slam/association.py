"""Which landmark a reading is of: by Mahalanobis distance, one by one or jointly.

Neira, Tardós 2001, "Data association in stochastic mapping using the joint compatibility test".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError
from sequential.evaluate.consistency import chi2_quantile
from sequential.slam.estimate import SlamRun
from sequential.slam.problem import SlamProblem

__all__ = ["NEW", "REJECTED", "Association", "Pairings", "with_associations"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

REJECTED, NEW = -1, -2
METHODS = ("nearest", "joint")


@dataclass(frozen=True, slots=True, eq=False)
class Pairings:
    """N readings of one step beside L landmarks, linearised at the belief.

    Parameters
    ----------
    error : (N, L, m)
    jacobian : (N, L, m, c) by the tangent columns that a reading of that landmark involves
    columns : (N, L, c) which columns of `cov` they are
    noise : (N, m, m)
    cov : (d, d) of the joint belief
    """

    error: Array
    jacobian: Array
    columns: Ints
    noise: Array
    cov: Array

    def squared(self) -> Array:
        """(N, L) squared Mahalanobis distances, each reading by itself."""
        at = self.columns
        prior = self.cov[at[..., :, None], at[..., None, :]]
        spread = self.jacobian @ prior @ np.swapaxes(self.jacobian, -1, -2) + self.noise[:, None]
        solved = np.linalg.solve(spread, self.error[..., None])[..., 0]
        return np.asarray(np.einsum("nlm,nlm->nl", self.error, solved))

    def joint(self, pairs: Sequence[tuple[int, int]]) -> float:
        """Squared Mahalanobis distance of several pairings (reading, landmark) together."""
        m, d = self.error.shape[2], len(self.cov)
        stacked, noise = np.zeros((m * len(pairs), d)), np.zeros((m * len(pairs),) * 2)
        for place, (n, landmark) in enumerate(pairs):
            rows = slice(m * place, m * place + m)
            stacked[rows, self.columns[n, landmark]] = self.jacobian[n, landmark]
            noise[rows, rows] = self.noise[n]
        error = np.concatenate([self.error[pair] for pair in pairs])
        return float(error @ np.linalg.solve(stacked @ self.cov @ stacked.T + noise, error))


@dataclass(frozen=True, slots=True)
class Association:
    """How readings without an id find their landmark.

    Parameters
    ----------
    method : "nearest", the closest landmark inside the gate, closest pairs first and no landmark twice; or
        "joint", the largest set of pairings of one step's readings that is compatible as a whole (branch and
        bound, JCBB)
    gate : χ² quantile within which a reading may be of a landmark
    new : χ² quantile beyond which of *every* landmark a reading begins a new one; what lies between the two
        is rejected, for it is too far to be sure of and too near to be another.  A landmark that another
        reading of the step is of does not count: two readings of one step are of two landmarks
    """

    method: str = "joint"
    gate: float = 0.99
    new: float = 0.9999

    def __post_init__(self) -> None:
        if self.method not in METHODS or not 0.0 < self.gate <= self.new < 1.0:
            msg = (
                f"an Association has a method of {', '.join(METHODS)} and quantiles 0 < gate <= new < 1; got "
                f"{self.method!r}, {self.gate}, {self.new}"
            )
            raise ModelError(msg)

    def choose(self, candidates: Pairings) -> Ints:
        """(N,) column of the landmark of each reading, `NEW` or `REJECTED`."""
        count, landmarks, m = candidates.error.shape
        if not landmarks:
            return np.full(count, NEW)
        squared = candidates.squared()
        inside = squared <= chi2_quantile(self.gate, m)
        pairs = _nearest(squared, inside)
        if self.method == "joint" and len(pairs) > 1:
            pairs = _joint(candidates, squared, inside, self.gate)
        # two readings of one step are of two landmarks, so that one which is taken explains no other
        taken = {landmark for _, landmark in pairs}
        free = [landmark for landmark in range(landmarks) if landmark not in taken]
        beyond = squared[:, free] > chi2_quantile(self.new, m)
        chosen = np.where(beyond.all(axis=1), NEW, REJECTED)
        for n, landmark in pairs:
            chosen[n] = landmark
        return chosen.astype(np.int64)


def _nearest(squared: Array, inside: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Pairs (reading, landmark), closest first, each landmark once."""
    found: list[tuple[int, int]] = []
    left = np.where(inside, squared, np.inf)
    while np.isfinite(left).any():
        n, landmark = np.unravel_index(int(np.argmin(left)), left.shape)
        found.append((int(n), int(landmark)))
        left[n, :] = left[:, landmark] = np.inf
    return found


def _joint(
    candidates: Pairings, squared: Array, inside: NDArray[np.bool_], gate: float
) -> list[tuple[int, int]]:
    """The largest jointly compatible set of pairs, of the largest ones the closest."""
    count, m = squared.shape[0], candidates.error.shape[2]
    limits = [chi2_quantile(gate, m * size) if size else 0.0 for size in range(count + 1)]
    options = [[int(j) for j in np.argsort(squared[n]) if inside[n, j]] for n in range(count)]
    best: tuple[int, float, list[tuple[int, int]]] = (0, 0.0, [])

    def branch(n: int, pairs: list[tuple[int, int]], distance: float) -> None:
        nonlocal best
        if len(pairs) + count - n < best[0]:
            return
        if n == count:
            if len(pairs) > best[0] or (len(pairs) == best[0] and distance < best[1]):
                best = len(pairs), distance, pairs
            return
        taken = {landmark for _, landmark in pairs}
        for landmark in options[n]:
            if landmark not in taken:
                more = [*pairs, (n, landmark)]
                together = candidates.joint(more)
                if together <= limits[len(more)]:
                    branch(n + 1, more, together)
        branch(n + 1, pairs, distance)

    branch(0, [], 0.0)
    return best[2]


def with_associations(problem: SlamProblem, run: SlamRun) -> SlamProblem:
    """The problem with the ids that a filter found, readings that it rejected left out: for a graph.

    Raises
    ------
    DataError
        where the run has associated nothing.
    """
    if run.associations is None:
        msg = "the run holds no associations; every reading of its problem came with an id"
        raise DataError(msg)
    groups, at = [], 0
    for group, steps in zip(problem.factors, problem.steps, strict=True):
        if group.unknown is None:
            groups.append(group)
            continue
        found = run.associations[at : at + len(group)]
        at += len(group)
        kept = found != REJECTED
        index = np.array(group.index)[kept]
        index[:, group.unknown] = found[kept]
        noise = np.asarray(group.noise_cov)
        groups.append(
            replace(
                group,
                index=index,
                z=np.asarray(group.z)[kept],
                noise_cov=noise[kept] if noise.ndim == 3 else noise,
                step=steps[kept],
                unknown=None,
            )
        )
    return replace(problem, factors=tuple(groups))
