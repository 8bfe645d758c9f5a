"""FilterPy's `ExtendedKalmanFilter`, taken over."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.attributes import Control, Covariance, Matrix, State, as_covariance, as_reading
from sequential.filterpy.linear_update import linear_update, tidy
from sequential.filterpy.recursion import Recursion, columns, without_missing

__all__ = ["FilterpyExtended"]

Array = NDArray[Any]


class FilterpyExtended(Recursion):
    """A filter that is given the Jacobian and the function of its sensor with every reading."""

    x: Any = State()
    P: Any = Covariance("dim_x")
    F: Any = Matrix("dim_x", "dim_x")
    Q: Any = Covariance("dim_x")
    R: Any = Covariance("dim_z")
    B: Any = Control()
    K: Any

    @property
    def _I(self) -> Array:
        return np.eye(self.dim_x)

    def predict_x(self, u: Any = 0) -> None:
        """Move the state; a class derived from FilterPy's may bring a function of its own."""
        self.x = self.F @ self.x + columns(self.B, u, self.x)

    def predict(self, u: Any = 0) -> None:
        """One step ahead: `predict_x`, then F P Fᵀ + Q."""
        self.predict_x(u)
        self._own(P=tidy(self.F @ self.P @ self.F.T + self.Q))
        self._keep("prior")

    def update(
        self,
        z: Any,
        HJacobian: Callable[..., Any],
        Hx: Callable[..., Any],
        R: Any = None,
        args: Any = (),
        hx_args: Any = (),
        residual: Callable[[Any, Any], Any] = np.subtract,
    ) -> None:
        """Take in a reading.

        Parameters
        ----------
        z : the reading; None is no reading, NaN in a component is no reading of that component
        HJacobian : `HJacobian(x, *args)` -> (dim_z, dim_x)
        Hx : `Hx(x, *hx_args)` -> what the sensor would read
        residual : `residual(z, Hx)`, for angles
        """
        if z is None or np.isnan(as_reading(z, self.dim_z, 1)).all():
            self._after_update()
            return
        given = as_reading(z, self.dim_z, 1).reshape(np.shape(z) or (1,))
        R = self.R if R is None else as_covariance(R, self.dim_z, "R")
        H = np.asarray(HJacobian(self.x, *as_tuple(args)), dtype=np.float64).reshape(self.dim_z, self.dim_x)
        difference = residual(given, Hx(self.x, *as_tuple(hx_args)))
        self.y = as_reading(difference, self.dim_z, self.x.ndim)
        missing = np.isnan(given.ravel())
        if missing.any():
            self.y, H, R = without_missing(missing, self.y, H, R)
        self._own(**linear_update(self.P, H, R)._asdict())
        self.x = self.x + self.K @ self.y
        self._after_update(z if np.ndim(z) else given, int(missing.sum()))

    def predict_update(
        self, z: Any, HJacobian: Callable[..., Any], Hx: Callable[..., Any],
        args: Any = (), hx_args: Any = (), u: Any = 0,
    ) -> None:  # fmt: skip
        """One step ahead and a reading, linearised at the prediction."""
        self.predict(u)
        self.update(z, HJacobian, Hx, None, args, hx_args)


def as_tuple(arguments: Any) -> tuple[Any, ...]:
    """Further arguments as FilterPy takes them: a tuple, or the only one."""
    return arguments if isinstance(arguments, tuple) else (arguments,)
