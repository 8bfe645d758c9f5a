"""What one kind of measurement says about the variables that it joins."""

from __future__ import annotations

import abc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import JacobianMismatchError, ModelError
from sequential.jacobians import STEP, TOLERANCE
from sequential.manifold import Manifold

__all__ = ["FactorModel", "check_factor_model"]

Array = NDArray[np.float64]


class FactorModel(abc.ABC):
    """A measurement between variables; final classes are small frozen dataclasses.

    Everything works on a batch: `values` holds one array (N, n_i) for each variable that is joined, in the
    order of `manifolds`, and `z` (N, size of `measured`) the measurements.

    The error is GTSAM's, `e = measured.local(z, expected(values))`, in the chart of the measurement at `z`,
    so that its covariance is the noise's and a native factor's error is the same vector.  A filter's
    innovation is `-e`.
    """

    manifolds: tuple[Manifold, ...]
    measured: Manifold

    @abc.abstractmethod
    def expected(self, *values: Array) -> Array:
        """What would be measured without noise: (N, size of `measured`)."""

    @abc.abstractmethod
    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """Derivative of `errors` by a tangent step of each variable: (N, m, d_i) each."""

    def errors(self, z: Array, *values: Array) -> Array:
        """`local(z, expected)`: (N, m) in the tangent of the measurement."""
        return self.measured.local(z, self.expected(*values))

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """Where variable number `missing` is, given the others and the measurements: (N, n_missing).

        This is how a landmark is begun at its first sighting, and a pose predicted from the one before.

        Raises
        ------
        ModelError
            where the measurement does not determine that variable (a bearing alone, a range alone).
        """
        msg = (
            f"{type(self).__name__} alone does not determine its variable number {missing}; "
            "give it an initial value, or wait for more measurements"
        )
        raise ModelError(msg)


def check_factor_model(model: FactorModel, z: Array, *values: Array) -> None:
    """Compare the Jacobians of a model with central differences at given variables.

    Raises
    ------
    JacobianMismatchError
        naming the variable, the worst entry, what was declared and what differences give.
    """
    declared = model.jacobians(z, *values)
    for i, jacobian in enumerate(declared):
        expected = _difference(model, z, values, i)
        gap = np.abs(jacobian - expected)
        if not np.all(gap <= TOLERANCE * max(1.0, float(np.abs(expected).max()))):
            n, row, column = np.unravel_index(int(np.nanargmax(gap)), gap.shape)
            msg = (
                f"the Jacobian of {type(model).__name__} by its variable {i} disagrees with central "
                f"differences at row {row}, column {column}: declared {jacobian[n, row, column]:.6g}, "
                f"differences give {expected[n, row, column]:.6g}; mend it"
            )
            raise JacobianMismatchError(msg)


def _difference(model: FactorModel, z: Array, values: Sequence[Array], i: int) -> Array:
    """(N, m, d_i) by central differences."""
    manifold = model.manifolds[i]
    columns = []
    for j in range(manifold.dim):
        step = np.zeros(manifold.dim)
        step[j] = STEP
        ahead, behind = list(values), list(values)
        ahead[i], behind[i] = manifold.retract(values[i], step), manifold.retract(values[i], -step)
        columns.append((model.errors(z, *ahead) - model.errors(z, *behind)) / (2 * STEP))
    return np.stack(columns, axis=-1)
