"""Tune the noise of a dataset's model to the readings in use."""

from __future__ import annotations

from math import isfinite

from factorlab.compare.table import Tuned
from factorlab.datasets import Dataset
from sequential.errors import ModelError
from sequential.model import StateSpace
from sequential.tuning import Tuning

__all__ = ["fit", "tuned_of"]


def fit(dataset: Dataset) -> tuple[Tuned, StateSpace]:
    """Maximise the innovation likelihood over the knobs; held-out readings and truth are not looked at.

    Raises
    ------
    ModelError
        where the dataset has nothing that may be tuned.
    """
    from sequential.tuning import tune  # with it comes scipy.optimize

    if not dataset.knobs:
        msg = f"there is nothing to tune in {dataset.name!r}: its model has no noise that can be scaled"
        raise ModelError(msg)
    found = tune(dataset.build, dataset.knobs, dataset.log)
    return tuned_of(found), dataset.build(found.values)


def tuned_of(found: Tuning) -> Tuned:
    """The lines of a table about a tuning, whatever its method."""
    intervals = {name: found.interval(name) for name in found.values}
    return Tuned(
        initial=dict(found.initial),
        values=dict(found.values),
        intervals={name: (low, high) for name, (low, high) in intervals.items() if isfinite(high - low)},
        units=dict(found.units),
        seconds=found.seconds,
        log_likelihood_before=found.log_likelihood_before,
        log_likelihood_after=found.log_likelihood_after,
        evaluations=found.evaluations,
        message="; ".join([*filter(None, [found.message]), *map(found.doubt, found.unidentified)]),
    )
