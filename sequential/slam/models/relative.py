"""What is known of one variable, and what lies between two of them: priors, odometry, loop closures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.manifold import Array, Manifold
from sequential.slam.factor_model import FactorModel
from sequential.slam.models.groups import between, compose, inverse, require_group

__all__ = ["Between", "Prior"]


@final
@dataclass(frozen=True)
class Prior(FactorModel):
    """One variable is measured itself: ``e = local(z, x)``.

    Parameters
    ----------
    manifold : of the variable, and of the measurement
    """

    manifold: Manifold

    def __post_init__(self) -> None:
        object.__setattr__(self, "manifolds", (self.manifold,))
        object.__setattr__(self, "measured", self.manifold)

    def expected(self, *values: Array) -> Array:
        """The variable."""
        return values[0]

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """Derivative of the logarithm."""
        return (_of_local(self.manifold, z, values[0]),)

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """Where it was measured."""
        return np.array(z)


@final
@dataclass(frozen=True)
class Between(FactorModel):
    """What lies between two variables is measured: ``e = local(z, a⁻¹ b)``; odometry and loop closures.

    Parameters
    ----------
    manifold : of both variables and of the measurement: `SE2()`, `SE3()`, `SO2()`, `SO3()` or `Vector(n)`

    Raises
    ------
    ModelError
        for a manifold that is no group.
    """

    manifold: Manifold

    def __post_init__(self) -> None:
        require_group(self.manifold, "Between")
        object.__setattr__(self, "manifolds", (self.manifold, self.manifold))
        object.__setattr__(self, "measured", self.manifold)

    def expected(self, *values: Array) -> Array:
        """``a⁻¹ b``."""
        return between(self.manifold, *values)

    def jacobians(self, z: Array, *values: Array) -> tuple[Array, ...]:
        """By a and b: a step of a is carried to b by the adjoint, with a minus (Sola et al. 2018, eq. 58)."""
        by_b = _of_local(self.manifold, z, between(self.manifold, *values))
        carried, _ = self.manifold.transport(*values)
        return -by_b @ carried, by_b

    def place(self, missing: int, z: Array, *values: Array | None) -> Array:
        """``a z``, or ``b z⁻¹``."""
        if missing == 1 and values[0] is not None:
            return compose(self.manifold, values[0], z)
        if missing == 0 and values[1] is not None:
            return compose(self.manifold, values[1], inverse(self.manifold, z))
        return super().place(missing, z, *values)


def _of_local(manifold: Manifold, x: Array, y: Array) -> Array:
    """Derivative (N, d, d) of ``local(x, y)`` by a step at y."""
    inverted: Array = np.asarray(np.linalg.inv(manifold.transport(x, y)[1]), dtype=np.float64)
    return inverted
