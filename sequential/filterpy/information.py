"""FilterPy's `InformationFilter`, taken over."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sequential.errors import SolverError
from sequential.filterpy.attributes import Control, Covariance, Matrix, State, as_covariance, as_reading
from sequential.filterpy.linear_update import LOG_2PI, log_density, pseudo_inverse
from sequential.filterpy.recursion import columns, without_missing
from sequential.filterpy.state_space import LinearRecursion

__all__ = ["FilterpyInformation"]

Array = NDArray[Any]


class FilterpyInformation(LinearRecursion):
    """A linear filter that carries the inverse of P, so that it may begin by knowing nothing: P_inv = 0.

    `x` is always a state.  Directions in which P_inv is still singular keep the number that they began with.
    `S` is the information after the update, P_inv + Hᵀ R_inv H, as FilterPy calls it; likelihoods use the
    covariance of the innovation, and are those of the other filters.
    """

    derived: ClassVar[frozenset[str]] = frozenset(
        {"_I", "_F_inv", "_no_information", "log_likelihood", "likelihood"}
    )
    renamed: ClassVar[dict[str, str]] = {"_F": "F"}
    compute_log_likelihood: bool
    x: Any = State()
    F: Any = Matrix("dim_x", "dim_x")
    P_inv: Any = Covariance("dim_x")
    Q: Any = Covariance("dim_x")
    H: Any = Matrix("dim_z", "dim_x")
    R_inv: Any = Covariance("dim_z")
    B: Any = Control()
    inv: Any
    K: Any

    def __init__(self, original: Any) -> None:
        super().__init__(original)
        # of the last reading: arrays from the start, which Saver can stack
        self._seen, self._weight, self._before = self.H.copy(), self.R_inv.copy(), self.P_inv.copy()

    def predict(self, u: Any = 0) -> None:
        """One step ahead: P_inv <- (I + M Q)⁻¹ M, M = F⁻ᵀ P_inv F⁻¹, where Q and P_inv may be singular.

        Raises
        ------
        SolverError
            where both F and P_inv are singular.
        """
        self.x = self.F @ self.x + columns(self.B, u, self.x)
        n = self.dim_x
        try:
            back = self.inv(self.F)
            moved = back.T @ self.P_inv @ back
            after = np.linalg.solve(np.eye(n) + moved @ self.Q, moved)
        except np.linalg.LinAlgError:
            after = self._through_covariance()
        self.P_inv = 0.5 * (after + after.T)
        self._keep("prior")

    def _through_covariance(self) -> Array:
        try:
            P = self.F @ np.linalg.inv(self.P_inv) @ self.F.T + self.Q
            return np.asarray(np.linalg.inv(P))
        except np.linalg.LinAlgError:
            raise SolverError(
                "F is singular, and so is P_inv or the covariance ahead: information cannot be carried over "
                "this step; use FilterPy's KalmanFilter, which carries the covariance"
            ) from None

    def update(self, z: Any, R_inv: Any = None) -> None:
        """Take in a reading; `R_inv` is the inverse of its noise covariance."""
        reading = None if z is None else as_reading(z, self.dim_z, self.x.ndim)
        if reading is None or np.isnan(reading).all():
            self._after_update()
            self.z = None
            return
        weight = self.R_inv if R_inv is None else as_covariance(R_inv, self.dim_z, "R_inv")
        self.y, H = reading - self.H @ self.x, self.H
        missing = np.isnan(reading.ravel())
        if missing.any():
            # the weight of what is there: the block of R that is left, inverted
            _, _, R = without_missing(missing, self.y, H, np.linalg.inv(weight))
            self.y, H, weight = without_missing(missing, self.y, H, np.linalg.inv(R))
        told = H.T @ weight
        self._seen, self._weight, self._before = H, weight, self.P_inv
        self.S = self.P_inv + told @ H
        self.P_inv = self.S.copy()
        self.K = self._solve(self.S, told)
        self.x = self.x + self.K @ self.y
        self._after_update(z, int(missing.sum()))

    def _solve(self, information: Array, right: Array) -> Array:
        """Solve where there is information; elsewhere nothing moves."""
        if self.inv is np.linalg.inv:
            try:
                sigma = np.sqrt(np.diagonal(information))
                if (np.diagonal(np.linalg.cholesky(information)) > 1e-7 * sigma).all():
                    return np.linalg.solve(information, right)
            except np.linalg.LinAlgError:
                pass
            solved: Array = pseudo_inverse(information) @ right
            return solved
        return np.asarray(self.inv(information) @ right)

    def _keep(self, when: str) -> None:
        setattr(self, f"x_{when}", self.x.copy())
        setattr(self, f"P_inv_{when}", self.P_inv.copy())

    def _expected(self) -> Array | None:
        """Covariance of the last innovation, or None where the state had none before."""
        try:
            P, R = np.linalg.inv(self._before), np.linalg.inv(self._weight)
        except np.linalg.LinAlgError:
            return None
        return np.asarray(self._seen @ P @ self._seen.T + R)

    @property
    def log_likelihood(self) -> float:
        """Log density of the last reading; 0 where nothing was read, or nothing was known before it."""
        if self._log_likelihood is None:
            S = self._expected()
            self._log_likelihood = (
                0.0 if S is None else log_density(self.y, S) + 0.5 * LOG_2PI * self._missing
            )
        return self._log_likelihood

    @property
    def mahalanobis(self) -> float:
        """Length of the last innovation in standard deviations; 0 where nothing was known before it."""
        S, y = self._expected(), np.ravel(self.y)
        return 0.0 if S is None else math.sqrt(max(float(y @ pseudo_inverse(S) @ y), 0.0))

    @property
    def P(self) -> Array:
        """Covariance of the state: the inverse of P_inv, infinite variances where that has none."""
        try:
            return np.asarray(self.inv(self.P_inv))
        except np.linalg.LinAlgError:
            return np.diag(np.full(self.dim_x, np.inf))

    @property
    def R(self) -> Array:
        """Covariance of the measurement noise: the inverse of R_inv."""
        return np.asarray(np.linalg.inv(self.R_inv))
