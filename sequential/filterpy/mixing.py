"""FilterPy's `IMMEstimator`, taken over with all its filters."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.recursion import TakenOver
from sequential.filterpy.sigma_points import moments

__all__ = ["FilterpyMixing"]

Array = NDArray[Any]


class FilterpyMixing(TakenOver):
    """Interacting multiple models (Blom, Bar-Shalom 1988) over filters that were taken over.

    Means and spreads of states go through the hooks of the first filter that has them, so that angles mix as
    that filter says; probabilities are kept by log likelihoods, which do not underflow.
    """

    filters: list[Any]
    likelihood: Array
    mu: Array
    M: Any
    omega: Array
    cbar: Array
    N: int

    def __init__(self, original: Any, filters: list[Any]) -> None:
        super().__init__(original)
        self.filters, self.N = filters, len(filters)
        self.mu, self.M = np.array(self.mu, dtype=np.float64), np.array(self.M, dtype=np.float64)
        self._log_likelihood = 0.0
        self._compute_mixing_probabilities()

    @property
    def log_likelihood(self) -> float:
        """Log density of the last reading under the mixture of all filters."""
        return self._log_likelihood

    def predict(self, u: Any = None) -> None:
        """Mix the beliefs by the probability of each change of mode, then predict with every filter."""
        states = [np.ravel(f.x) for f in self.filters]
        mixed = [self._mixture(states, weights) for weights in self.omega.T]
        for f, (x, P) in zip(self.filters, mixed, strict=True):
            f.x = x.reshape(self.x.shape)
            f.P = P
            f.predict(u)
        self._compute_state_estimate()
        self._keep("prior")

    def update(self, z: Any) -> None:
        """Take in a reading with every filter, and judge the filters by it."""
        for f in self.filters:
            f.update(z)
        logs = np.array([f.log_likelihood for f in self.filters])
        self.likelihood = np.array([f.likelihood for f in self.filters])
        best = float(logs.max())
        weighted = self.cbar * np.exp(logs - best)
        self._log_likelihood = best + math.log(float(weighted.sum()))
        self.mu = weighted / weighted.sum()
        self._compute_mixing_probabilities()
        self._compute_state_estimate()
        self._keep("post")

    def _mixture(self, states: list[Array], weights: Array) -> tuple[Array, Array]:
        """Mean (n,) and covariance of the beliefs of all filters under weights that sum to one."""
        hooks = next((f for f in self.filters if hasattr(f, "residual_x")), None)
        difference = np.subtract if hooks is None else hooks.residual_x
        mean, spread = moments(
            np.array(states), weights, getattr(hooks, "x_mean", None), difference,
            getattr(hooks, "state_add", np.add),
        )  # fmt: skip
        P = (spread * weights[:, None]).T @ spread
        for f, weight in zip(self.filters, weights, strict=True):
            P = P + weight * f.P
        return mean, P

    def _compute_state_estimate(self) -> None:
        mean, self.P = self._mixture([np.ravel(f.x) for f in self.filters], self.mu)
        self.x = mean.reshape(self.filters[0].x.shape)

    def _compute_mixing_probabilities(self) -> None:
        """omega[i, j] is the probability of mode i before, given mode j; a mode out of reach stays itself."""
        self.cbar = self.mu @ self.M
        joint = self.M * self.mu[:, None]
        self.omega = np.divide(joint, self.cbar, out=np.eye(self.N), where=self.cbar > 0.0)
