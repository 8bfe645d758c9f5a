"""FilterPy's `CubatureKalmanFilter`, taken over."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.attributes import Covariance, State, as_covariance, as_reading
from sequential.filterpy.bierman import root
from sequential.filterpy.extended import as_tuple
from sequential.filterpy.linear_update import tidy
from sequential.filterpy.recursion import Recursion
from sequential.filterpy.sigma_points import moments, residuals, sigma_update, through

__all__ = ["FilterpyCubature"]

Array = NDArray[Any]


class FilterpyCubature(Recursion):
    """A cubature filter (Arasaratnam, Haykin 2009): 2 dim_x points, drawn anew before a reading.

    FilterPy's observes the points that the process moved, without the process noise; on a linear problem
    only points drawn anew give the Kalman filter.  The script's means and residuals are honoured.
    """

    x: Any = State()
    P: Any = Covariance("dim_x")
    Q: Any = Covariance("dim_x")
    R: Any = Covariance("dim_z")
    K: Any
    sigmas_f: Any
    sigmas_h: Any
    fx: Any
    hx: Any
    x_mean: Any
    z_mean: Any
    residual_x: Any
    residual_z: Any
    _dt: float

    def predict(self, dt: float | None = None, fx_args: Any = ()) -> None:
        """One step ahead of `dt` seconds through `fx(x, dt, *fx_args)`; x becomes a column, as there."""
        dt = self._dt if dt is None else dt
        self.sigmas_f = through(lambda point: self.fx(point, dt, *as_tuple(fx_args)), self._draw())
        mean, dx = moments(self.sigmas_f, self._weights(), self.x_mean, self.residual_x)
        self._own(x=mean[:, None], P=tidy(dx.T @ dx / len(dx) + self.Q))
        self._keep("prior")

    def update(self, z: Any, R: Any = None, hx_args: Any = ()) -> None:
        """Take in a reading through `hx(x, *hx_args)`; None, or NaN in a component, is nothing read."""
        missing = np.zeros(0, dtype=bool) if z is None else np.isnan(as_reading(z, self.dim_z, 1))
        if missing.all():
            self._after_update()
            return
        R = self.R if R is None else as_covariance(R, self.dim_z, "R")
        drawn = self._draw()
        self.sigmas_h = through(lambda point: self.hx(point, *as_tuple(hx_args)), drawn)
        zp, dz = moments(self.sigmas_h, self._weights(), self.z_mean, self.residual_z)
        innovation = as_reading(self.residual_z(as_reading(z, self.dim_z, 1), zp), self.dim_z, 1)
        if missing.any():
            innovation[missing], dz[:, missing] = 0.0, 0.0
            R = np.where(missing | missing[:, None], np.diag(missing.astype(float)), R)
        dx = residuals(drawn, np.ravel(self.x), self.residual_x)
        update = sigma_update(self.P, dx, (dz, self.sigmas_h), self._weights(), R)
        self._own(**update._asdict())
        self.y = innovation[:, None]
        self.x = self.x + (self.K @ innovation).reshape(self.x.shape)
        self._after_update(z, int(missing.sum()))

    def _draw(self) -> Array:
        """(2 n, n) points at √n times the columns of a root of P, either side of x."""
        x, away = np.ravel(self.x), np.sqrt(self.dim_x) * root(self.P)
        return np.concatenate([x + away, x - away])

    def _weights(self) -> Array:
        return np.full(2 * self.dim_x, 0.5 / self.dim_x)
