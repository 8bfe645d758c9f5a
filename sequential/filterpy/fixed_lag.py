"""FilterPy's `FixedLagSmoother`, taken over."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.attributes import Control, Covariance, Matrix, State, as_reading
from sequential.filterpy.linear_update import linear_update, tidy
from sequential.filterpy.recursion import Recursion, columns, without_missing

__all__ = ["FilterpyFixedLag"]

Array = NDArray[Any]


class FilterpyFixedLag(Recursion):
    """A filter that keeps correcting its last N states (Anderson, Moore 1979, Optimal Filtering, 7.3).

    `xSmooth[k]` knows every reading up to k + N - 1.  Corrections use cross-covariances with the prediction,
    which make each equal to an RTS smoother over the readings so far; FilterPy's use the filtered covariance.
    """

    x: Any = State()
    P: Any = Covariance("dim_x")
    F: Any = Matrix("dim_x", "dim_x")
    Q: Any = Covariance("dim_x")
    H: Any = Matrix("dim_z", "dim_x")
    R: Any = Covariance("dim_z")
    B: Any = Control()
    K: Any
    N: int | None
    count: int
    xSmooth: list[Array]

    def __init__(self, original: Any) -> None:
        super().__init__(original)
        self.xSmooth = list(getattr(original, "xSmooth", []))
        self._cross: list[Array] = []  # cov(x_j, x_k) of the states still in the window, oldest first

    def smooth(self, z: Any, u: Any = None) -> None:
        """Take in a reading: filter to `x`, `P`, and correct the last N entries of `xSmooth`."""
        self._step(z, u, self.N or 1)
        self.count += 1

    def smooth_batch(self, zs: Any, N: int, us: Any = None) -> tuple[Array, Array]:
        """Smoothed and filtered states of a sequence, the filter left as it is."""
        kept = dict(vars(self))
        self.xSmooth, self._cross = [], []
        filtered = []
        for k, z in enumerate(zs):
            self._step(z, None if us is None else us[k], N)
            filtered.append(self.x)
        smoothed = self.xSmooth
        vars(self).update(kept)
        return np.array(smoothed), np.array(filtered)

    def _step(self, z: Any, u: Any, lag: int) -> None:
        before = self.F @ self.x + columns(self.B, u, self.x)
        P = tidy(self.F @ self.P @ self.F.T + self.Q)
        window = [cross @ self.F.T for cross in self._cross[-(lag - 1) :]] if lag > 1 else []
        window.append(P)
        reading = np.full(self.dim_z, np.nan) if z is None else z
        reading = as_reading(reading, self.dim_z, before.ndim)
        missing = np.isnan(reading.ravel())
        y, H, R = reading - self.H @ before, self.H, self.R
        if missing.any():
            y, H, R = without_missing(missing, y, H, R)
        K, S, SI, after = linear_update(P, H, R)
        self._own(K=K, S=S, SI=SI, P=after, y=y)
        moved = H.T @ (SI @ y)
        self.xSmooth = [*self.xSmooth, before]
        first = len(self.xSmooth) - len(window)
        for i, cross in enumerate(window):
            self.xSmooth[first + i] = self.xSmooth[first + i] + cross @ moved
        left = (np.eye(self.dim_x) - K @ H).T
        self._cross = [cross @ left for cross in window]
        self.x = before + K @ y
        self.x_s = self.xSmooth[first]
        self._missing, self._log_likelihood = int(missing.sum()), None if not missing.all() else 0.0
