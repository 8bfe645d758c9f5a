"""FilterPy's `SquareRootKalmanFilter`, taken over."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.attributes import Control, Matrix, State, as_covariance, as_reading
from sequential.filterpy.bierman import root, ud_update
from sequential.filterpy.recursion import columns, without_missing
from sequential.filterpy.state_space import LinearRecursion

__all__ = ["FilterpySquareRoot"]

Array = NDArray[Any]


class FilterpySquareRoot(LinearRecursion):
    """A linear filter that carries a root of P through QR (Kaminski, Bryson, Schmidt 1971).

    `P1_2 @ P1_2.T` is P, and so with Q1_2, R1_2 and S1_2.
    """

    derived: ClassVar[frozenset[str]] = LinearRecursion.derived | {"_P", "_Q", "_R"}
    x: Any = State()
    F: Any = Matrix("dim_x", "dim_x")
    H: Any = Matrix("dim_z", "dim_x")
    B: Any = Control()
    M: Any
    K: Any
    S1_2: Any
    SI1_2: Any
    _P1_2: Array
    _P1_2_prior: Array
    _P1_2_post: Array
    _Q1_2: Array
    _R1_2: Array

    def predict(self, u: Any = 0) -> None:
        """One step ahead."""
        self.x = self.F @ self.x + columns(self.B, u, self.x)
        stacked = np.hstack([self.F @ self._P1_2, self._Q1_2])
        self._P1_2 = np.asarray(np.linalg.qr(stacked.T, mode="r")).T
        self._keep("prior")

    def update(self, z: Any, R2: Any = None) -> None:
        """Take in a reading; `R2` is a root of its noise covariance, a number a standard deviation."""
        reading = None if z is None else as_reading(z, self.dim_z, self.x.ndim)
        if reading is None or np.isnan(reading).all():
            self._after_update()
            return
        noise = self._R1_2 if R2 is None else as_covariance(R2, self.dim_z, "R2")
        self.y, H = reading - self.H @ self.x, self.H
        missing = np.isnan(reading.ravel())
        if missing.any():
            self.y, H, R = without_missing(missing, self.y, H, noise @ noise.T)
            noise = root(R, "R").T
        self._correct(H, noise)
        self.x = self.x + self.K @ self.y
        self._after_update(z, int(missing.sum()))

    def _correct(self, H: Array, noise: Array) -> None:
        """Triangularise [[R½, H P½], [0, P½]]; without noise in some component, go through UD instead."""
        m = self.dim_z
        array = np.zeros((m + self.dim_x, m + self.dim_x))
        array[:m, :m] = noise.T
        array[m:, :m] = (H @ self._P1_2).T
        array[m:, m:] = self._P1_2.T
        self.M = array
        triangle = np.asarray(np.linalg.qr(array, mode="r"))
        self.S1_2 = triangle[:m, :m].T
        pivots = np.abs(np.diagonal(self.S1_2))
        free = not (np.abs(noise).sum(axis=1) > 0.0).all()
        if free or not (pivots > 1e-14 * np.linalg.norm(self.S1_2, axis=1)).all():
            self.SI1_2 = np.linalg.pinv(self.S1_2)
            self.K, U, d = ud_update(self.P, H, noise @ noise.T)
            self._P1_2 = np.asarray(np.linalg.qr((U * np.sqrt(d)).T, mode="r")).T
            return
        self.SI1_2 = np.linalg.solve(self.S1_2, np.eye(m))
        self.K = triangle[:m, m:].T @ self.SI1_2
        self._P1_2 = triangle[m:, m:].T

    def _keep(self, when: str) -> None:
        setattr(self, f"x_{when}", self.x.copy())
        setattr(self, f"_P1_2_{when}", self._P1_2.copy())

    def residual_of(self, z: Any) -> Array:
        """Reading minus what the state expects."""
        residual: Array = as_reading(z, self.dim_z, self.x.ndim) - self.H @ self.x
        return residual

    def measurement_of_state(self, x: Any) -> Array:
        """What the sensor would read at x."""
        seen: Array = self.H @ np.asarray(x, dtype=np.float64)
        return seen

    @property
    def P(self) -> Any:
        """Covariance of the state."""
        return self._P1_2 @ self._P1_2.T

    @P.setter
    def P(self, value: Any) -> None:
        self._P1_2 = root(as_covariance(value, self.dim_x, "P")).T

    @property
    def Q(self) -> Any:
        """Covariance of the process noise of one step."""
        return self._Q1_2 @ self._Q1_2.T

    @Q.setter
    def Q(self, value: Any) -> None:
        self._Q1_2 = root(as_covariance(value, self.dim_x, "Q"), "Q").T

    @property
    def R(self) -> Any:
        """Covariance of the measurement noise."""
        return self._R1_2 @ self._R1_2.T

    @R.setter
    def R(self, value: Any) -> None:
        self._R1_2 = root(as_covariance(value, self.dim_z, "R"), "R").T

    @property
    def P1_2(self) -> Array:
        """Root of P."""
        return self._P1_2

    @property
    def Q1_2(self) -> Array:
        """Root of Q."""
        return self._Q1_2

    @property
    def R1_2(self) -> Array:
        """Root of R."""
        return self._R1_2

    @property
    def P_prior(self) -> Array:
        """Covariance after the last prediction."""
        return self._P1_2_prior @ self._P1_2_prior.T

    @property
    def P_post(self) -> Array:
        """Covariance after the last update."""
        return self._P1_2_post @ self._P1_2_post.T

    @property
    def S(self) -> Any:
        """Covariance of the innovation."""
        return self.S1_2 @ self.S1_2.T

    @property
    def SI(self) -> Any:
        """Inverse of S."""
        return self.SI1_2.T @ self.SI1_2
