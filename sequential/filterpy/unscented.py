"""FilterPy's `UnscentedKalmanFilter`, taken over with its sigma points and hooks."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.filterpy.attributes import Covariance, State, as_covariance, as_reading
from sequential.filterpy.linear_update import joseph
from sequential.filterpy.passes import smoother_gain
from sequential.filterpy.recursion import Recursion
from sequential.filterpy.sigma_points import (
    moments,
    regression,
    residuals,
    settled,
    sigma_covariance,
    sigma_update,
    sturdy_points,
    through,
)

__all__ = ["FilterpyUnscented"]

Array = NDArray[Any]


class FilterpyUnscented(Recursion):
    """An unscented filter with the script's fx, hx, sigma points, means, residuals and sum of states.

    Sigma points are drawn anew wherever state or covariance have changed since they were drawn, so that a
    second reading in one step is taken in about the belief that the first one left.
    """

    derived: ClassVar[frozenset[str]] = Recursion.derived | {"msqrt"}
    renamed: ClassVar[dict[str, str]] = {}
    x: Any = State()
    P: Any = Covariance("dim_x")
    Q: Any = Covariance("dim_x")
    R: Any = Covariance("dim_z")
    K: Any
    Wm: Array
    Wc: Array
    sigmas_f: Any
    sigmas_h: Any
    fx: Any
    hx: Any
    x_mean: Any
    z_mean: Any
    residual_x: Any
    residual_z: Any
    state_add: Any
    inv: Any
    _dt: float

    def __init__(self, original: Any) -> None:
        super().__init__(original)
        self.points_fn = sturdy_points(original.points_fn)
        # where points were drawn last; arrays from the start, which Saver can stack
        self._drawn_x, self._drawn_P = np.full(self.dim_x, np.nan), np.full_like(self.P, np.nan)

    @property
    def _dim_x(self) -> int:
        return self.dim_x

    @property
    def _dim_z(self) -> int:
        return self.dim_z

    def predict(self, dt: float | None = None, UT: Any = None, fx: Any = None, **fx_args: Any) -> None:
        """One step ahead of `dt` seconds through `fx(x, dt, **fx_args)`."""
        self.compute_process_sigmas(self._dt if dt is None else dt, fx, **fx_args)
        if UT is not None:
            x, P = UT(self.sigmas_f, self.Wm, self.Wc, self.Q, self.x_mean, self.residual_x)
            self._own(x=x, P=P)
        else:
            mean, df = moments(self.sigmas_f, self.Wm, self.x_mean, self.residual_x, self.state_add)
            dx = residuals(self._points, self.x, self.residual_x)
            self._own(x=mean, P=sigma_covariance(self.P, dx, df, self.Wc, self.Q))
        self._redraw()
        self._keep("prior")

    def compute_process_sigmas(self, dt: float, fx: Any = None, **fx_args: Any) -> None:
        """Draw sigma points of the belief and move each by fx."""
        fx = self.fx if fx is None else fx
        self._points = np.asarray(self.points_fn.sigma_points(self.x, self.P), dtype=np.float64)
        self.sigmas_f = through(lambda point: fx(point, dt, **fx_args), self._points)

    def _redraw(self) -> None:
        self.sigmas_f = np.asarray(self.points_fn.sigma_points(self.x, self.P), dtype=np.float64)
        self._drawn_x, self._drawn_P = self.x.copy(), self.P.copy()

    def _is_stale(self) -> bool:
        return not (np.array_equal(self._drawn_x, self.x) and np.array_equal(self._drawn_P, self.P))

    def update(self, z: Any, R: Any = None, UT: Any = None, hx: Any = None, **hx_args: Any) -> None:
        """Take in a reading through `hx(x, **hx_args)`; None, or NaN in a component, is nothing read."""
        missing = np.zeros(0, dtype=bool) if z is None else np.isnan(np.asarray(z, dtype=np.float64).ravel())
        if missing.all():
            self._after_update()
            return
        if self._is_stale():
            self._redraw()
        hx = self.hx if hx is None else hx
        self.sigmas_h = through(lambda point: hx(point, **hx_args), self.sigmas_f)
        m = self.sigmas_h.shape[1]
        R = self.R if R is None else as_covariance(R, m, "R")
        given = as_reading(z, m, 1)
        if UT is not None:
            zp, self.S = UT(self.sigmas_h, self.Wm, self.Wc, R, self.z_mean, self.residual_z)
            dz = residuals(self.sigmas_h, zp, self.residual_z)
        else:
            zp, dz = moments(self.sigmas_h, self.Wm, self.z_mean, self.residual_z)
        self.y = as_reading(self.residual_z(given if np.ndim(z) else float(given[0]), zp), m, 1)
        if missing.any():
            self.y[missing], dz[:, missing] = 0.0, 0.0
            R = np.where(missing | missing[:, None], np.diag(missing.astype(float)), R)
        self._correct(dz, R)
        self._after_update(z, int(missing.sum()))

    def _correct(self, dz: Array, R: Array) -> None:
        dx = residuals(self.sigmas_f, self.x, self.residual_x)
        seen = dz, self.sigmas_h
        self._own(**sigma_update(self.P, dx, seen, self.Wc, R, self.inv)._asdict())
        self.x = self.state_add(self.x, self.K @ self.y)

    def cross_variance(self, x: Any, z: Any, sigmas_f: Array, sigmas_h: Array) -> Array:
        """(dim_x, dim_z) cross-covariance of moved and observed sigma points about x and z."""
        dx, dz = residuals(sigmas_f, x, self.residual_x), residuals(sigmas_h, z, self.residual_z)
        return np.asarray(dx.T @ (self.Wc[:, None] * dz))

    def batch_filter(
        self, zs: Any, Rs: Any = None, dts: Any = None, UT: Any = None, saver: Any = None
    ) -> tuple[Array, Array]:
        """Filter a sequence; `Rs` and `dts` may hold one entry for each step.  Returns means, covariances."""
        count = len(zs)
        means, covs = np.empty((count, *self.x.shape)), np.empty((count, *self.P.shape))
        for k in range(count):
            self.predict(dt=None if dts is None else dts[k], UT=UT)
            self.update(zs[k], None if Rs is None else Rs[k], UT=UT)
            means[k], covs[k] = self.x, self.P
            if saver is not None:
                saver.save()
        return means, covs

    def rts_smoother(
        self, Xs: Any, Ps: Any, Qs: Any = None, dts: Any = None, UT: Any = None
    ) -> tuple[Array, Array, Array]:
        """Smooth what `batch_filter` gave (Särkkä 2008), residuals and sums by the script's hooks.

        Entry k of Qs and dts belongs to the step from k to k + 1.  Returns states, covariances, gains.
        """
        if len(Xs) != len(Ps):
            raise ShapeError(
                f"Xs has {len(Xs)} entries and Ps {len(Ps)}; the smoother takes both from one pass"
            )
        xs, ps = np.array(Xs, dtype=np.float64), np.array(Ps, dtype=np.float64)
        gains = np.zeros_like(ps)
        steps = np.broadcast_to(self._dt if dts is None else np.asarray(dts, dtype=np.float64), len(xs))
        for k in range(len(xs) - 2, -1, -1):
            Q = self.Q if Qs is None else as_covariance(Qs[k], self.dim_x, "Q")
            xs[k], ps[k], gains[k] = self._smooth(
                (xs[k], ps[k]), (xs[k + 1], ps[k + 1]), Q, float(steps[k]), UT
            )
        return xs, ps, gains

    def _smooth(
        self, filtered: tuple[Array, Array], after: tuple[Array, Array], Q: Array, dt: float, UT: Any
    ) -> tuple[Array, Array, Array]:
        """One step back: P - K P_ahead Kᵀ as a sum over sigma points, where the weights leave it definite."""
        (x, P), Wc = filtered, self.Wc[:, None]
        drawn = self.points_fn.sigma_points(x, P)
        moved = through(lambda point: self.fx(point, dt), drawn)
        if UT is not None:
            ahead, P_ahead = UT(moved, self.Wm, self.Wc, Q, self.x_mean, self.residual_x)
            df = residuals(moved, ahead, self.residual_x)
        else:
            ahead, df = moments(moved, self.Wm, self.x_mean, self.residual_x, self.state_add)
            P_ahead = sigma_covariance(P, residuals(drawn, x, self.residual_x), df, self.Wc, Q)
        dx = residuals(drawn, x, self.residual_x)
        K = smoother_gain(dx.T @ (Wc * df), P_ahead, self.inv)
        left = dx - df @ K.T
        kept = settled(left.T @ (Wc * left) + K @ Q @ K.T, P, self.Wc)
        if kept is None:
            H, _, rest = regression(P, dx, df, self.Wc)
            kept = joseph(P, H, rest + Q, K)
        smoothed = kept + K @ after[1] @ K.T
        moved_by = K @ np.ravel(self.residual_x(after[0], ahead))
        return np.ravel(self.state_add(x, moved_by)), 0.5 * (smoothed + smoothed.T), K
