"""The numbers of a model that may be turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sequential.errors import ModelError

__all__ = ["Knob"]


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
