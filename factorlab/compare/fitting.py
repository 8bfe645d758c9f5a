"""Tune the noise of a dataset's model to the readings in use."""

from __future__ import annotations

from typing import Any

from factorlab.compare.table import Tuned
from factorlab.datasets import Dataset
from sequential.errors import ModelError
from sequential.model import StateSpace

__all__ = ["fit"]


def fit(dataset: Dataset) -> tuple[Tuned, StateSpace]:
    """Maximise the innovation likelihood over the knobs; held-out readings and truth are not looked at.

    Raises
    ------
    ModelError
        where the dataset has nothing that may be tuned.
    """
    from sequential.tuning import tune

    if not dataset.knobs:
        msg = f"there is nothing to tune in {dataset.name!r}: its model has no noise that can be scaled"
        raise ModelError(msg)
    found: Any = tune(dataset.build, dataset.knobs, dataset.log)
    tuned = Tuned(
        initial=dict(found.initial),
        values=dict(found.values),
        intervals={name: (float(a), float(b)) for name, (a, b) in getattr(found, "intervals", {}).items()},
        units={knob.name: knob.unit for knob in dataset.knobs},
        seconds=found.seconds,
        log_likelihood_before=found.log_likelihood_before,
        log_likelihood_after=found.log_likelihood_after,
        evaluations=found.evaluations,
        message=found.message,
    )
    return tuned, dataset.build(found.values)
