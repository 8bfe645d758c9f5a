"""What filters taken over share: how they are copied and printed, what their last reading was worth."""

from __future__ import annotations

import copy
import math
import sys
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.filterpy.attributes import nothing_read
from sequential.filterpy.linear_update import LOG_2PI, log_density

__all__ = ["Recursion", "TakenOver", "columns", "without_missing"]

Array = NDArray[Any]

SMALLEST = sys.float_info.min  # FilterPy's likelihood before the first reading, and its floor afterwards


class TakenOver:
    """A copy of what a FilterPy object holds, under the same names."""

    x: Any
    P: Any
    x_prior: Any
    x_post: Any
    # attributes of the original by their names there, where they are called otherwise here
    renamed: ClassVar[Mapping[str, str]] = {}
    # attributes of the original that are derived here
    derived: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, original: Any) -> None:
        given = dict(vars(original))
        for name in ("dim_x", "dim_z", "_dim_x", "_dim_z"):
            if name in given:
                setattr(self, name.lstrip("_"), int(given.pop(name)))
        for name, value in given.items():
            if name not in self.derived:
                own = value.copy() if isinstance(value, np.ndarray) else value
                setattr(self, self.renamed.get(name, name), own)

    def _own(self, **values: Any) -> None:
        """Set what was computed here, past the checks that a script's assignments go through."""
        self.__dict__.update(values)

    def _keep(self, when: str) -> None:
        """Remember the belief as `x_prior` and `P_prior`, or as `x_post` and `P_post`."""
        own = self.__dict__
        own[f"x_{when}"], own[f"P_{when}"] = self.x.copy(), self.P.copy()

    def __repr__(self) -> str:
        lines = [f"{type(self).__name__}, taken over from FilterPy"]
        for name in sorted(name for name in vars(self) if not name.startswith("_")):
            value = vars(self)[name]
            if isinstance(value, np.ndarray) and value.ndim == 2 and value.shape[1] == 1:
                lines.append(f"{name} = {value.T}.T")
            elif not callable(value):
                head = f"{name} = "
                lines.append(head + str(value).replace("\n", "\n" + " " * len(head)))
        derived = [name for name in ("log_likelihood", "mahalanobis") if hasattr(type(self), name)]
        lines += [f"{name} = {getattr(self, name)}" for name in derived]
        return "\n".join(lines)


class Recursion(TakenOver):
    """A filter: `y` is the innovation of its last reading, `S` the covariance of that, `SI` its inverse."""

    dim_x: int
    dim_z: int
    y: Any
    z: Any
    S: Any
    SI: Any
    derived: ClassVar[frozenset[str]] = frozenset({"_log_likelihood", "_likelihood", "_mahalanobis", "_I"})

    def __init__(self, original: Any) -> None:
        super().__init__(original)
        self._log_likelihood: float | None = math.log(SMALLEST)
        self._missing = 0

    @property
    def log_likelihood(self) -> float:
        """Log density of the last reading; 0 where nothing was read, so that a sum over a log is its own."""
        if self._log_likelihood is None:
            # a component that is missing stands in S as one of unit variance that was met exactly
            self._log_likelihood = log_density(self.y, self.S) + 0.5 * LOG_2PI * self._missing
        return self._log_likelihood

    @property
    def likelihood(self) -> float:
        """Density of the last reading, never quite zero."""
        return max(math.exp(min(self.log_likelihood, 700.0)), SMALLEST)

    @property
    def mahalanobis(self) -> float:
        """Length of the last innovation in standard deviations."""
        y = np.ravel(self.y).astype(np.float64)
        return math.sqrt(max(float(y @ np.asarray(self.SI) @ y), 0.0))

    def _after_update(self, z: Any = None, missing: int = 0) -> None:
        """Keep the posterior; without a reading, say that there was none."""
        self._keep("post")
        self._missing = missing
        if z is None:
            self.z = nothing_read(self.dim_z)
            self.y = np.zeros_like(self.y, dtype=np.float64)
            self._log_likelihood = 0.0
        else:
            self.z = copy.deepcopy(z)
            self._log_likelihood = None


def without_missing(missing: NDArray[np.bool_], y: Array, H: Array, R: Array) -> tuple[Array, Array, Array]:
    """Innovation, H and R where some components (m,) are missing.

    Such a component has a row of zeros in H, an innovation of zero and noise of its own of unit variance: it
    changes nothing.
    """
    y, H, R = y.copy(), H.copy(), R.copy()
    y[missing], H[missing] = 0.0, 0.0
    R[missing], R[:, missing] = 0.0, 0.0
    R[missing, missing] = 1.0
    return y, H, R


def columns(B: Any, u: Any, x: Array) -> Array | float:
    """B u in the shape of x; no input, or an input of zero, moves nothing."""
    if B is None or u is None or (np.isscalar(u) and u == 0):
        return 0.0
    matrix, given = np.asarray(B, dtype=np.float64), np.asarray(u, dtype=np.float64).reshape(-1)
    if matrix.ndim == 0:
        matrix = matrix * np.eye(x.size, given.size) if matrix else np.zeros((x.size, given.size))
    elif matrix.ndim == 1:
        matrix = matrix.reshape(x.size, -1)
    if matrix.shape != (x.size, given.size):
        raise ShapeError(
            f"B has shape {matrix.shape} and u {np.shape(u)}; a state of {x.size} numbers pushed by "
            f"{given.size} inputs needs B of shape ({x.size}, {given.size})"
        )
    return (matrix @ given).reshape(x.shape)
