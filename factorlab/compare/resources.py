"""What an estimator costs besides accuracy: how long its answer waits, and how much it has to remember.

Memory is counted, not measured: states with their covariances, at eight bytes a number, that must be kept to
take the next reading (or, for a smoother, to give any answer).  Readings and solver workspace come on top and
are alike.  Measured resident memory of one Python process holding numpy, Numba and GTSAM says nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from factorlab.compare.estimators import KINDS
from sequential.history import Run
from sequential.manifold import Manifold

__all__ = ["Resources", "kilobytes", "resources"]

WINDOW_S = 5.5  # of the row `fixed_lag`


@dataclass(frozen=True, slots=True)
class Resources:
    """`latency_s` is how long after a moment its estimate stands: 0 online, up to the whole log after it."""

    latency_s: float
    states_kept: int
    memory_kb: float

    def to_json(self) -> dict[str, Any]:
        """Plain numbers under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


def resources(name: str, run: Run) -> Resources:
    """Latency and memory of an estimator by its name, on the log that it was run on."""
    span, nodes = float(run.t[-1] - run.t[0]) * 1e-9, len(run.t)
    if not KINDS[name].online:
        return Resources(span, nodes, kilobytes(run.manifold, nodes))
    if name.startswith("isam2"):
        return Resources(0.0, nodes, kilobytes(run.manifold, nodes))
    kept = 1
    if name == "fixed_lag":
        first = np.searchsorted(run.t, run.t - round(WINDOW_S * 1e9))
        kept = int((np.arange(nodes) - first).max()) + 1
    return Resources(0.0, kept, kilobytes(run.manifold, kept))


def kilobytes(manifold: Manifold, states: int) -> float:
    """States with what a pass over them keeps: one belief for a filter, else four matrices each.

    A chain keeps the prediction, the filtered belief, the way from the state before and the marginal.
    """
    n, d = manifold.size, manifold.dim
    numbers = n + d * d if states == 1 else states * (n + 2 * d + 4 * d * d)
    return 8e-3 * numbers
