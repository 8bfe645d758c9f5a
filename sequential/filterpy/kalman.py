"""FilterPy's `KalmanFilter`, taken over."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.filterpy.attributes import Control, Covariance, Matrix, State, as_covariance, as_reading
from sequential.filterpy.dimensions import require_dimensions
from sequential.filterpy.linear_update import Update, correlated_update, linear_update, log_density
from sequential.filterpy.passes import filter_pass, smoother_pass
from sequential.filterpy.recursion import SMALLEST, columns, without_missing
from sequential.filterpy.state_space import LinearRecursion
from sequential.kernels.scripted import predict_step, update_step

__all__ = ["FilterpyKalman"]

Array = NDArray[Any]


class FilterpyKalman(LinearRecursion):
    """A linear filter under FilterPy's names: x, P, F, H, Q, R, B, M in; K, y, S, SI and the beliefs out."""

    dim_u: int = 0
    x: Any = State()
    P: Any = Covariance("dim_x")
    F: Any = Matrix("dim_x", "dim_x")
    Q: Any = Covariance("dim_x")
    H: Any = Matrix("dim_z", "dim_x")
    R: Any = Covariance("dim_z")
    B: Any = Control()
    M: Any = Matrix("dim_x", "dim_z")
    inv: Any
    K: Any
    _alpha_sq: float

    def __init__(self, original: Any) -> None:
        super().__init__(original)
        self._still = np.zeros(self.dim_x)

    @property
    def _I(self) -> Array:
        return np.eye(self.dim_x)

    @property
    def alpha(self) -> float:
        """Fading memory: the predicted covariance is α² F P Fᵀ + Q."""
        return math.sqrt(self._alpha_sq)

    @alpha.setter
    def alpha(self, value: Any) -> None:
        if not np.isscalar(value) or not value >= 1:  # type: ignore[operator]
            raise ModelError(f"alpha is {value!r}; fading memory takes one number, 1 or more")
        self._alpha_sq = float(np.asarray(value).item()) ** 2

    def predict(self, u: Any = None, B: Any = None, F: Any = None, Q: Any = None) -> None:
        """One step ahead; matrices given here serve this step only."""
        own = self.__dict__
        own["x"], own["P"] = x, P = self.get_prediction(u, B, F, Q)
        own["x_prior"], own["P_prior"] = x.copy(), P.copy()

    def get_prediction(
        self, u: Any = None, B: Any = None, F: Any = None, Q: Any = None
    ) -> tuple[Array, Array]:
        """State and covariance one step ahead, the filter left as it is."""
        F = self.F if F is None else np.ascontiguousarray(F, dtype=np.float64)
        Q = self.Q if Q is None else as_covariance(Q, self.dim_x, "Q")
        push = columns(self.B if B is None else B, u, self.x)
        still = self._still if isinstance(push, float) else push.reshape(-1)
        x, P = np.empty_like(self.x), np.empty_like(self.P)
        predict_step(F, self.P, Q, self.x.reshape(-1), still, self._alpha_sq, x.reshape(-1), P)
        return x, P

    def update(self, z: Any, R: Any = None, H: Any = None) -> None:
        """Take in a reading: None is no reading, NaN in a component is no reading of that component."""
        self._take(z, R, H)

    def update_correlated(self, z: Any, R: Any = None, H: Any = None) -> None:
        """Take in a reading whose noise is correlated with the error of the prediction by M."""
        self._take(z, R, H, self.M)

    def _take(self, z: Any, R: Any, H: Any, M: Any = None) -> None:
        reshaped = H is None
        if M is None and self.inv is np.linalg.inv and self._take_compiled(z, R, H):
            return
        if not (seen := self._look(z, R, H)):
            self._after_update()
            return
        reading, self.y, H, R, missing = seen
        if M is not None and missing.any():
            M = np.where(missing, 0.0, M)
        self._own(**self._judge(H, R, M)._asdict())
        self.x = self.x + self.K @ self.y
        self._after_update(reading if reshaped else z, int(missing.sum()))

    def _take_compiled(self, z: Any, R: Any, H: Any) -> bool:
        """Update in compiled code; False, and nothing done, where the reading is not whole or in doubt."""
        if z is None:
            return False
        rows = self.H if H is None else np.ascontiguousarray(np.atleast_2d(H), dtype=np.float64)
        m = len(rows)
        reading = as_reading(z, m, self.x.ndim)
        noise = self.R if R is None else as_covariance(R, m, "R")
        y, S, SI, K = np.empty(reading.shape), np.empty((m, m)), np.empty((m, m)), np.empty((self.dim_x, m))
        x, P = np.empty_like(self.x), np.empty_like(self.P)
        flat = self.x.reshape(-1), reading.reshape(-1), y.reshape(-1)
        if update_step(self.P, rows, noise, *flat, S, SI, K, x.reshape(-1), P):
            return False
        own = self.__dict__
        own["y"], own["S"], own["SI"], own["K"], own["x"], own["P"] = y, S, SI, K, x, P
        own["z"], own["x_post"], own["P_post"] = reading.copy(), x.copy(), P.copy()
        if H is not None:
            own["z"] = copy.deepcopy(z)
        self._missing, self._log_likelihood = 0, None
        return True

    def _judge(self, H: Array, R: Array, M: Any = None) -> Update:
        if M is None:
            return linear_update(self.P, H, R, self.inv)
        return correlated_update(self.P, H, R, M, self.inv)

    def _look(self, z: Any, R: Any, H: Any) -> tuple[Array, Array, Array, Array, Any] | None:
        """Reading, innovation, H, R and a mask of what is missing; None where nothing was read."""
        if z is None:
            return None
        H = self.H if H is None else np.atleast_2d(np.asarray(H, dtype=np.float64))
        R = self.R if R is None else as_covariance(R, len(H), "R")
        reading = as_reading(z, len(H), self.x.ndim)
        y, missing = reading - H @ self.x, np.isnan(reading.ravel())
        if not missing.any():
            return reading, y, H, R, missing
        return None if missing.all() else (reading, *without_missing(missing, y, H, R), missing)

    def get_update(self, z: Any = None) -> tuple[Array, Array]:
        """State and covariance that a reading would give, the filter left as it is."""
        if not (seen := self._look(z, None, None)):
            return self.x, self.P
        _, y, H, R, _ = seen
        update = self._judge(H, R)
        return self.x + update.K @ y, update.P

    def update_sequential(self, start: int, z_i: Any, R_i: Any = None, H_i: Any = None) -> None:
        """Take in some components of a reading, those from `start` on."""
        length = np.size(z_i)
        rows = slice(start, start + length)
        H = self.H[rows] if H_i is None else np.reshape(np.asarray(H_i, dtype=np.float64), (length, -1))
        R = self.R[rows, rows] if R_i is None else as_covariance(R_i, length, "R_i")
        reading = as_reading(z_i, length, self.x.ndim)
        missing = np.isnan(reading.ravel())
        y, H, R = without_missing(missing, reading - H @ self.x, H, R)
        update = self._judge(H, R)
        self.y, self.K, self.z = self.y.copy(), self.K.copy(), copy.copy(self.z)
        self.y[rows], self.K[:, rows] = y.reshape(self.y[rows].shape), update.K
        self._own(P=update.P)
        self.z[rows] = np.reshape(reading, self.z[rows].shape)
        self.x = self.x + update.K @ y
        self._keep("post")

    def predict_steadystate(self, u: Any = 0, B: Any = None) -> None:
        """Move the state alone: the covariance has settled."""
        self.x = self.F @ self.x + columns(self.B if B is None else B, u, self.x)
        self._keep("prior")

    def update_steadystate(self, z: Any) -> None:
        """Correct the state alone, by the gain K as it stands."""
        if not (seen := self._look(z, None, None)):
            self._after_update()
            return
        reading, self.y, _, _, missing = seen
        self.x = self.x + self.K @ self.y
        self._after_update(reading, int(missing.sum()))

    def batch_filter(
        self, zs: Any, Fs: Any = None, Qs: Any = None, Hs: Any = None, Rs: Any = None, Bs: Any = None,
        us: Any = None, update_first: bool = False, saver: Any = None,  # noqa: FBT001, FBT002  (FilterPy's)
    ) -> tuple[Array, Array, Array, Array]:  # fmt: skip
        """Filter a sequence; matrices may be lists of one entry for each step.

        Returns
        -------
        means and covariances after each update, then those after each prediction
        """
        return filter_pass(self, zs, (Fs, Qs, Hs, Rs, Bs, us), update_first=update_first, saver=saver)

    def rts_smoother(
        self, Xs: Any, Ps: Any, Fs: Any = None, Qs: Any = None, inv: Any = np.linalg.inv
    ) -> tuple[Array, Array, Array, Array]:
        """Smooth what `batch_filter` gave (Rauch, Tung, Striebel 1965).

        Entry k of Fs and Qs belongs to the step that leads to k.

        Returns
        -------
        states, covariances, gains, and covariances predicted from the node before
        """
        own_Fs = self.F[None] if Fs is None else np.array([np.asarray(F, dtype=np.float64) for F in Fs])
        own_Qs = self.Q[None] if Qs is None else np.array([as_covariance(Q, self.dim_x, "Qs") for Q in Qs])
        return smoother_pass(Xs, Ps, own_Fs, own_Qs, inv)

    def residual_of(self, z: Any) -> Array:
        """Reading minus what the prediction expected."""
        residual: Array = as_reading(z, self.dim_z, self.x.ndim) - self.H @ self.x_prior
        return residual

    def measurement_of_state(self, x: Any) -> Array:
        """What the sensor would read at x."""
        seen: Array = self.H @ np.asarray(x, dtype=np.float64)
        return seen

    def log_likelihood_of(self, z: Any) -> float:
        """Log density of a reading under the current state and S."""
        if z is None:
            return math.log(SMALLEST)
        return log_density(as_reading(z, len(self.S), self.x.ndim) - self.H @ self.x, self.S)

    def test_matrix_dimensions(
        self, z: Any = None, H: Any = None, R: Any = None, F: Any = None, Q: Any = None
    ) -> None:
        """Raise `ShapeError` where these matrices, or the filter's own, do not fit together."""
        require_dimensions(self, z, H, R, F, Q)
