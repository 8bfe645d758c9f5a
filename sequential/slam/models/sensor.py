"""Any sensor of a `StateSpace` as a factor of one variable: declared once for filters and for graphs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.jacobians import difference
from sequential.manifold import Array, Manifold
from sequential.model import SensorModel, evaluate
from sequential.slam.factor_model import FactorModel

__all__ = ["OfSensor"]


@final
@dataclass(frozen=True, eq=False)
class OfSensor(FactorModel):
    """A `SensorModel` read by one variable: ``e = local(z, observe(x))``.

    The noise of the factors is what the `Factors` say; take it from `sensor.noise_cov` where it is the same.

    Parameters
    ----------
    sensor : the model, such as `Position(…)` or `Direction(…)`
    manifold : of the variable
    context : what the reading brings along (which landmark of a table): one for the whole group
    """

    sensor: SensorModel
    manifold: Manifold
    context: Sequence[float] = ()

    def __post_init__(self) -> None:
        functions = self.sensor.functions(self.manifold)
        context = np.zeros(max(functions.inputs, len(self.context), 1))
        context[: len(self.context)] = self.context
        object.__setattr__(self, "manifolds", (self.manifold,))
        object.__setattr__(self, "measured", self.sensor.manifold)
        object.__setattr__(self, "_functions", functions)
        object.__setattr__(self, "_context", context)

    def _observe(self, x: Array) -> Array:
        f = self._functions  # type: ignore[attr-defined]
        return evaluate(f.value, x, self._context, 0.0, f.params, self.measured.size)  # type: ignore[attr-defined]

    def expected(self, *values: Array) -> Array:
        """What the sensor would read."""
        rows = [self._observe(x) for x in values[0]]
        return np.array(rows).reshape(len(values[0]), self.measured.size)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """The sensor's own Jacobian, or differences, carried into the chart at z."""
        f, d, m = self._functions, self.manifold.dim, self.measured.dim  # type: ignore[attr-defined]
        slopes = np.empty((len(z), m, d))
        for n, x in enumerate(values[0]):
            if f.jacobian is None:
                slopes[n] = difference(self._observe, x, self.manifold, self.measured)
            else:
                slopes[n] = evaluate(f.jacobian, x, self._context, 0.0, f.params, m * d).reshape(m, d)  # type: ignore[attr-defined]
        inverse = self.measured.transport(z, self.expected(values[0]))[1]
        solved: Array = np.asarray(np.linalg.solve(inverse, slopes), dtype=np.float64)
        return (solved,)
