"""Tune the noise of a dataset's model, or take it from a recording at rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np
from numpy.typing import ArrayLike

from factorlab.compare.declaration import Build, noise_kind
from factorlab.compare.verdict import Finding
from factorlab.datasets import Dataset
from factorlab.tuning.findings import findings_at_rest, findings_of
from factorlab.tuning.writing import lines_at_rest, lines_of
from sequential.errors import ModelError
from sequential.jacobians import unchecked
from sequential.log import SensorLog
from sequential.tuning import (
    Knob,
    Tuning,
    autocovariance_least_squares,
    expectation_maximization,
    noise_from_still,
    tune,
    tune_by_nis,
)

__all__ = ["METHODS", "Fitted", "UnknownKnobError", "tune_dataset", "tune_still"]

METHODS = ("ml", "nis", "em", "als", "still")


class UnknownKnobError(ModelError):
    """A name that no knob has."""


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """One tuning with its findings; `write` are the lines to put into the model."""

    name: str
    title: str
    tuning: Tuning
    findings: tuple[Finding, ...]
    write: tuple[str, ...]
    dataset: Dataset | None = None

    @property
    def failed(self) -> bool:
        """Whether a finding is FAIL."""
        return any(finding.status == "FAIL" for finding in self.findings)


def tune_dataset(
    dataset: Dataset,
    method: str = "ml",
    *,
    asked: Mapping[str, float | None] | None = None,
    profile: bool = False,
    max_gap: float | None = None,
    seed: int = 0,
) -> Fitted:
    """Tune on the readings in use; held-out ones and the truth are not looked at.

    Parameters
    ----------
    method : "ml", "nis", "em" or "als"
    asked : knobs to turn, with another initial value or None; by default all ("ml"), or those of the process
        noise, by one factor ("nis")
    profile : intervals from the profile likelihood ("ml")
    seed : of the resampled NIS ("nis")

    Raises
    ------
    UnknownKnobError, ModelError, DataError, SolverError
    """
    if method == "em":
        found = expectation_maximization(dataset.model, dataset.log, max_gap=max_gap)
    elif method == "als":
        found = autocovariance_least_squares(dataset.model, dataset.log, max_gap=max_gap)
    else:
        found = _over_knobs(dataset, method, asked or {}, profile=profile, max_gap=max_gap, seed=seed)
    findings = findings_of(dataset, found, max_gap)
    return Fitted(dataset.name, dataset.title, found, findings, lines_of(dataset, found), dataset)


def _over_knobs(
    dataset: Dataset,
    method: str,
    asked: Mapping[str, float | None],
    *,
    profile: bool,
    max_gap: float | None,
    seed: int,
) -> Tuning:
    if not dataset.knobs:
        raise ModelError(f"there is nothing to tune in {dataset.name!r}: its model has no noise to be scaled")
    knobs = _with_initial(dataset.knobs, asked)
    if method == "nis":
        turn = list(asked) or process_knobs(dataset.build, knobs)
        if not turn:
            names = ", ".join(knob.name for knob in knobs)
            raise ModelError(
                f"no knob of {dataset.name!r} is process noise alone; name with --knob what the NIS is to "
                f"turn, one of {names}"
            )
        rng = np.random.default_rng(seed)
        return tune_by_nis(dataset.build, knobs, dataset.log, turn=turn, rng=rng, max_gap=max_gap)
    held = {knob.name: knob.initial for knob in knobs if asked and knob.name not in asked}
    turned = [knob for knob in knobs if knob.name not in held]
    found = tune(
        lambda values: dataset.build({**held, **values}),
        turned,
        dataset.log,
        profile=profile,
        max_gap=max_gap,
    )
    return replace(found, notes=(*found.notes, f"held as they were: {', '.join(held)}")) if held else found


def _with_initial(knobs: tuple[Knob, ...], asked: Mapping[str, float | None]) -> tuple[Knob, ...]:
    """All knobs, those that were given another initial value with it."""
    names = [knob.name for knob in knobs]
    for name in asked:
        if name not in names:
            near = get_close_matches(name, names, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(names)}"
            raise UnknownKnobError(f"no knob is called {name!r}; {hint}")
    return tuple(
        replace(knob, initial=value) if (value := asked.get(knob.name)) is not None else knob
        for knob in knobs
    )


def process_knobs(build: Build, knobs: tuple[Knob, ...]) -> list[str]:
    """Names of the knobs that change process noise and nothing else."""
    values = {knob.name: knob.initial for knob in knobs}
    with unchecked():
        before = build(values)
        return [
            knob.name
            for knob in knobs
            if noise_kind(before, build({**values, knob.name: 1.5 * knob.initial})) == "process"
        ]


def tune_still(
    log: SensorLog, name: str, declared: ArrayLike | None = None, lsb: float | None = None, title: str = ""
) -> Fitted:
    """R of one stream of a log that was recorded at rest."""
    found = noise_from_still(log, name, declared=declared, lsb=lsb)
    findings = findings_at_rest(name, found)
    return Fitted(name, title or f"{name}, at rest", found, findings, lines_at_rest(name, found))
