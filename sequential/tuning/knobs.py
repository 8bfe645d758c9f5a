"""The numbers of a model that may be turned, and what turning them gave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sequential.errors import ModelError

__all__ = ["Knob", "Tuning"]


@dataclass(frozen=True, slots=True)
class Knob:
    """A positive number of a model, such as a noise density or a standard deviation.

    Parameters
    ----------
    name : by which the model's builder knows it
    initial : first guess; also the centre of the prior
    unit : for tables
    decades : standard deviation of the prior on log10(value): 1 says "within a factor of ten or so"

    Raises
    ------
    ModelError
        where `initial` or `decades` is not a positive finite number.
    """

    name: str
    initial: float
    unit: str = ""
    decades: float = 1.0

    def __post_init__(self) -> None:
        for what in ("initial", "decades"):
            value = getattr(self, what)
            if not (np.isfinite(value) and value > 0):
                raise ModelError(
                    f"knob {self.name!r} has {what}={value}; it is searched on a logarithmic scale, so "
                    "it must be positive and finite"
                )


@dataclass(frozen=True, slots=True)
class Tuning:
    """What `tune` found.

    Parameters
    ----------
    values, initial : by knob name
    log_likelihood_before, log_likelihood_after : of the innovations, without the prior
    evaluations : filter passes, those for the uncertainty included
    seconds : wall time
    message : what the search and the curvature have to say; empty is good news
    decades : standard deviation of log10(value), by knob name, from the curvature of the posterior at the
        optimum; NaN where that is not a maximum in every direction
    converged : the search met its tolerances
    """

    values: Mapping[str, float]
    initial: Mapping[str, float]
    log_likelihood_before: float
    log_likelihood_after: float
    evaluations: int
    seconds: float
    message: str = ""
    decades: Mapping[str, float] = field(default_factory=dict)
    converged: bool = True

    def factor(self, name: str) -> float:
        """By how much a knob was turned."""
        return self.values[name] / self.initial[name]

    def interval(self, name: str, sigmas: float = 1.96) -> tuple[float, float]:
        """Interval of a value, 95 % unless told otherwise; symmetric on the logarithmic scale."""
        wide = 10.0 ** (sigmas * self.decades[name])
        return self.values[name] / wide, self.values[name] * wide
