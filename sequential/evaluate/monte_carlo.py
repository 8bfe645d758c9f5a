"""Many draws of one model hold an estimator to what it says about itself, at every moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import FactorlabError, ModelError, SolverError
from sequential.evaluate.consistency import AverageNees, Consistency, anees, nees, summarise, whole_nis
from sequential.history import Innovations, Run
from sequential.log import nanoseconds
from sequential.model import StateSpace
from sequential.run import Estimator, run
from sequential.simulate import Simulation, simulate

__all__ = ["MonteCarlo", "monte_carlo"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class MonteCarlo:
    """What repeated draws say about an estimator.

    `nees` is the average over the runs at every node beside its 95 % band, `nis` the normalised innovations
    squared of all runs together, by sensor; `rmse` and `sigma` are what the errors were and what was stated,
    by tangent direction.
    """

    t: Ints  # (N,) ns
    nees: AverageNees
    nis: Mapping[str, Consistency]
    rmse: Array  # (N, d) root mean square over the runs
    sigma: Array  # (N, d) root of the mean stated variance
    failed: int = 0  # draws that the estimator could not solve
    message: str = ""  # what the first of them said

    @property
    def verdict(self) -> str:
        """`consistent`, `overconfident` (errors larger than claimed) or `pessimistic`.

        The mean over all nodes is held to the band of a single node, since errors of one run go together.
        """
        low, high = self.nees.band
        if low <= self.nees.mean <= high:
            return "consistent"
        return "overconfident" if self.nees.mean > high else "pessimistic"

    def __str__(self) -> str:
        """One sentence."""
        low, high = self.nees.band
        return (
            f"{self.verdict}: ANEES {self.nees.mean:.3g} in {self.nees.runs} runs, {self.nees.dof} expected; "
            f"{100 * self.nees.share_inside:.0f} % of the steps inside [{low:.3g}, {high:.3g}]"
        )


def monte_carlo(
    model: StateSpace,
    estimator: Estimator,
    t: ArrayLike,
    rng: np.random.Generator,
    *,
    runs: int = 50,
    truth: StateSpace | None = None,
    inputs: ArrayLike | None = None,
    readings: Mapping[str, ArrayLike | int] | None = None,
    contexts: Mapping[str, ArrayLike] | None = None,
    part: str | ArrayLike | None = None,
    level: float = 0.95,
) -> MonteCarlo:
    """Draw logs, estimate, and hold the errors to what the estimator says of them.

    Parameters
    ----------
    model : what the estimator believes
    t : (N,) times of the truth, float seconds or int nanoseconds; the estimate is judged at all of them
    rng : the only source of chance; each run has a generator of its own that is spawned from it
    runs : how many draws
    truth : what the logs are drawn from; the model itself unless given
    inputs, readings, contexts : as for `simulate`
    part : name of a part of a product state, or tangent directions, to which the NEES is confined
    level : of the band

    Raises
    ------
    ModelError
        for fewer than two runs.
    SolverError
        where the estimator failed on half of the draws or more.

    Notes
    -----
    Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2: runs times the average is χ² with runs·d degrees of
    freedom at every step, so that 95 % of the steps of a matched filter are inside the band.
    """
    if runs < 2:
        raise ModelError(f"a Monte Carlo needs two runs or more, got {runs}")
    source = model if truth is None else truth
    settings: dict[str, Any] = {"inputs": inputs, "readings": readings, "contexts": contexts}
    values, errors, variances, seen, failures = [], [], [], [], []
    for own in rng.spawn(runs):
        drawn = simulate(source, t, own, **settings)
        try:
            found = run(estimator, model, drawn.log, at=drawn.t)
            normalised, error = _judged(found, drawn, part)
        except FactorlabError as fault:
            failures.append(str(fault))
            continue
        values.append(normalised)
        errors.append(error)
        variances.append(np.diagonal(found.cov, axis1=1, axis2=2))
        seen.append(found.innovations)
    if 2 * len(failures) >= runs:
        raise SolverError(
            f"{len(failures)} of {runs} draws could not be solved; the first said: {failures[0]}"
        )
    return MonteCarlo(
        nanoseconds(t),
        anees(values, _directions(model, part), level),
        {name: _together([one[name] for one in seen]) for name in seen[0]},
        np.sqrt(np.mean(np.square(errors), axis=0)),
        np.sqrt(np.mean(variances, axis=0)),
        len(failures),
        failures[0] if failures else "",
    )


def _judged(found: Run, drawn: Simulation, part: str | ArrayLike | None) -> tuple[Array, Array]:
    """NEES (N,) and errors (N, d) at the times of the truth."""
    rows = found.index(drawn.t)
    error = found.manifold.local(found.mean[rows], drawn.truth)
    return nees(found, drawn.truth, part=part, rows=rows), error


def _directions(model: StateSpace, part: str | ArrayLike | None) -> int:
    """How many tangent directions a part stands for."""
    every = np.arange(model.manifold.dim)
    if isinstance(part, str):
        whole: Any = model.manifold
        return len(every[whole.tangent(part)])
    return len(every if part is None else np.atleast_1d(every[np.asarray(part)]))


def _together(each: list[Innovations]) -> Consistency:
    """NIS of one sensor over all runs."""
    values = np.concatenate([whole_nis(one)[one.accepted] for one in each])
    gated = sum(int((~one.accepted).sum()) for one in each)
    return summarise(values, each[0].residual.shape[1], each[0].kind, gated)
