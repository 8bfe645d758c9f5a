"""The declaration: kinds of variables, and factors in groups of one model each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.log import frozen
from sequential.manifold import Manifold
from sequential.model import Loss
from sequential.noise import require_covariance
from sequential.slam.estimate import Values
from sequential.slam.factor_model import FactorModel

__all__ = ["Factors", "SlamProblem"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Factors:
    """Many measurements of one model.

    Parameters
    ----------
    model : what they say
    slots : kind of each variable that a measurement joins, such as ("x", "l")
    index : (N, k) which variable of its kind
    z : (N, size of `model.measured`)
    noise_cov : (m, m), (m,) variances, a number, or (N, m, m): one for each measurement
    loss : robust loss, or None
    step : (N,) when each arrives: the number of the newest moving variable known then; by default the
        largest index among its moving slots, 0 where it has none
    name : of the sensor, in tables and messages
    unknown : slot whose index is not known (association is the estimator's task; `index` is ignored there),
        or None
    gate : an estimator may reject a measurement beyond this quantile of χ² (0.999), or None
    """

    model: FactorModel
    slots: tuple[str, ...]
    index: ArrayLike
    z: ArrayLike
    noise_cov: ArrayLike
    loss: Loss | None = None
    step: ArrayLike | None = None
    name: str = ""
    unknown: int | None = None
    gate: float | None = None

    def __post_init__(self) -> None:
        m, count = self.model.measured.dim, len(np.asarray(self.z))
        index = np.ascontiguousarray(self.index, dtype=np.int64).reshape(count, -1)
        z = np.asarray(self.z, dtype=np.float64).reshape(count, -1)
        who = self.name or type(self.model).__name__
        if index.shape[1] != len(self.slots) or len(self.slots) != len(self.model.manifolds):
            msg = (
                f"{who} joins {len(self.model.manifolds)} variables; got {len(self.slots)} slots and "
                f"indices of shape {index.shape}"
            )
            raise ShapeError(msg)
        if z.shape[1] != self.model.measured.size:
            msg = f"{who} measures {self.model.measured.size} numbers, got z of shape {z.shape}"
            raise ShapeError(msg)
        noise = np.asarray(self.noise_cov, dtype=np.float64)
        if noise.ndim < 3:
            noise = require_covariance(noise, m, f"the noise_cov of {who}")
        elif noise.shape != (count, m, m):
            msg = f"{who} needs noise_cov of shape ({m}, {m}) or ({count}, {m}, {m}), got {noise.shape}"
            raise ShapeError(msg)
        for field_name, value in (
            ("index", frozen_ints(index)),
            ("z", frozen(z)),
            ("noise_cov", frozen(noise)),
        ):
            object.__setattr__(self, field_name, value)
        if self.step is not None:
            object.__setattr__(self, "step", frozen_ints(np.asarray(self.step)))

    def __len__(self) -> int:
        return len(np.asarray(self.z))

    def covs(self) -> Array:
        """(N, m, m)."""
        noise = np.asarray(self.noise_cov)
        return noise if noise.ndim == 3 else np.broadcast_to(noise, (len(self), *noise.shape))


@dataclass(frozen=True, eq=False)
class SlamProblem:
    """Variables and the measurements that join them.

    Parameters
    ----------
    kinds : manifold of each kind of variable, by one letter: {"x": SE2(), "l": Vector(2)}
    factors : groups of measurements; priors are factors too
    moving : kinds of which each step has one variable, newest last: the poses, velocities, biases
    start : values to begin from, where they are known (a graph file's vertices); others are placed by the
        first measurements that determine them
    t : (K,) int64 ns, time of each step, or None
    """

    kinds: Mapping[str, Manifold]
    factors: tuple[Factors, ...]
    moving: tuple[str, ...] = ("x",)
    start: Values | None = None
    t: Ints | None = None
    steps: tuple[Ints, ...] = field(init=False, repr=False)  # (N,) of each group

    def __post_init__(self) -> None:
        for kind in self.kinds:
            if len(kind) != 1 or not kind.isalpha():
                msg = f"a kind of variable is named by one letter, got {kind!r}"
                raise ModelError(msg)
        for group in self.factors:
            for slot, manifold in zip(group.slots, group.model.manifolds, strict=True):
                known = self.kinds.get(slot)
                if known is None or repr(known) != repr(manifold):
                    msg = (
                        f"{group.name or type(group.model).__name__} joins a variable of kind {slot!r} on "
                        f"{manifold}; the problem says {known if known is not None else 'nothing about it'}"
                    )
                    raise ModelError(msg)
        object.__setattr__(self, "steps", tuple(self._arrivals(group) for group in self.factors))

    def _arrivals(self, group: Factors) -> Ints:
        if group.step is not None:
            return np.asarray(group.step)
        columns = [k for k, slot in enumerate(group.slots) if slot in self.moving and k != group.unknown]
        if not columns:
            return np.zeros(len(group), dtype=np.int64)
        newest: Ints = np.asarray(group.index)[:, columns].max(axis=1)
        return newest

    def indices(self, kind: str) -> Ints:
        """Indices of all variables of a kind that some factor names, ascending."""
        named = [
            np.asarray(group.index)[:, k]
            for group in self.factors
            for k, slot in enumerate(group.slots)
            if slot == kind and k != group.unknown
        ]
        return np.unique(np.concatenate(named)) if named else np.zeros(0, dtype=np.int64)

    @property
    def count(self) -> int:
        """How many measurements there are, priors included."""
        return sum(len(group) for group in self.factors)


def frozen_ints(values: NDArray[np.int64]) -> Ints:
    """A read-only int64 copy."""
    own = np.array(values, dtype=np.int64)
    own.flags.writeable = False
    return own
