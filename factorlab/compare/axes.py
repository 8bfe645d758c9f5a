"""Error of each axis of a pose beside its stated σ: what Barfoot's figures of a state estimate show.

Position along the axes of the world, m; rotation as a vector in the axes of the body, rad (a heading on the
plane); both as estimate minus truth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets import Dataset, Truth
from sequential.history import Run
from sequential.manifold import SE2, SE3, SO3, Manifold, NavState, Product

__all__ = ["INSIDE_EXPECTED", "AxisErrors", "axis_errors"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

INSIDE_EXPECTED = 0.9973  # of a Gaussian within ±3σ
AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True, eq=False)
class AxisErrors:
    """Errors (M, a) of some axes and their standard deviations (M, a); `units` are "m" or "rad"."""

    t: Ints  # (M,) ns
    names: tuple[str, ...]
    units: tuple[str, ...]
    error: Array
    sigma: Array
    nees: Array | None = None  # (M,) of all axes together, χ² with as many degrees of freedom

    @property
    def turns(self) -> bool:
        """Whether a heading or a rotation is among the axes; of a place alone the length says enough."""
        return "rad" in self.units

    def rmse(self) -> Array:
        """(a,) root mean squares."""
        found: Array = np.sqrt(np.mean(self.error**2, axis=0))
        return found

    def inside(self) -> Array:
        """(a,) shares of errors within ±3σ."""
        found: Array = np.mean(np.abs(self.error) <= 3.0 * self.sigma, axis=0)
        return found

    def nees_per_axis(self) -> float | None:
        """Mean normalised squared error over its expectation: 1 where errors are as large as stated."""
        return None if self.nees is None else float(np.mean(self.nees)) / len(self.names)

    def to_json(self) -> dict[str, Any]:
        """One object an axis, and the normalised error of all together."""
        rmse, inside, sigma = self.rmse(), self.inside(), self.sigma
        plain: dict[str, Any] = {
            name: {
                "unit": unit,
                "rmse": float(rmse[k]),
                "mean": float(self.error[:, k].mean()),
                "rms_sigma": float(np.sqrt(np.mean(sigma[:, k] ** 2))),
                "inside_3sigma": float(inside[k]),
            }
            for k, (name, unit) in enumerate(zip(self.names, self.units, strict=True))
        }
        return plain | {"nees_per_axis": self.nees_per_axis(), "inside_3sigma_expected": INSIDE_EXPECTED}


def axis_errors(dataset: Dataset, run: Run) -> AxisErrors | None:
    """Errors of each axis against the truth; None where there is no truth, or no position in the state."""
    if dataset.truth is None:
        return None
    rows, truth = dataset.truth.at(run.t)
    if not len(rows):
        return None
    mean, cov = run.mean[rows], run.cov[rows]
    place = dataset.positions(run)[rows] - truth.position[:, : dataset.axes]
    spread = np.sqrt(np.diagonal(dataset.position_cov(run)[rows], axis1=1, axis2=2))
    names, units = AXES[: dataset.axes], ("m",) * dataset.axes
    turn = _turn(run.manifold, mean, cov, truth)
    if turn is None:
        return AxisErrors(truth.t, names, units, place, spread)
    error, sigma = turn
    labels = ("heading",) if error.shape[1] == 1 else ("rotation x", "rotation y", "rotation z")
    return AxisErrors(
        truth.t,
        (*names, *labels),
        (*units, *("rad",) * len(labels)),
        np.hstack([place, error]),
        np.hstack([spread, sigma]),
        _nees(run.manifold, mean, cov, truth),
    )


def _pose(manifold: Manifold) -> tuple[slice, slice, Manifold] | None:
    """Storage, tangent and manifold of the part that is a pose or an attitude."""
    kinds = (SE2, SE3, NavState, SO3)
    if isinstance(manifold, Product):
        for name, part in manifold.parts.items():
            if isinstance(part, kinds):
                return manifold.storage(name), manifold.tangent(name), part
        return None
    if isinstance(manifold, kinds):
        return slice(0, manifold.size), slice(0, manifold.dim), manifold
    return None


def _turn(manifold: Manifold, mean: Array, cov: Array, truth: Truth) -> tuple[Array, Array] | None:
    """Errors (M, 1 or 3) of heading or rotation, and their σ."""
    found = _pose(manifold)
    if found is None:
        return None
    storage, tangent, part = found
    x, at = mean[:, storage], tangent.start
    if isinstance(part, SE2):
        if truth.heading is None:
            return None
        off = x[:, 2] - truth.heading
        error = np.arctan2(np.sin(off), np.cos(off))[:, None]
        return error, np.sqrt(cov[:, at + 2, at + 2])[:, None]
    if truth.quaternion is None:
        return None
    turn = slice(at, at + 3)
    sigma = np.sqrt(np.diagonal(cov[:, turn, turn], axis1=1, axis2=2))
    # Log(truth⁻¹ estimate): the step of the body's axes from where they are to where they are said to be
    return SO3().local(truth.quaternion, x[:, :4]), sigma


def _nees(manifold: Manifold, mean: Array, cov: Array, truth: Truth) -> Array | None:
    """(M,) normalised squared errors of the whole pose, in the chart of its covariance."""
    found = _pose(manifold)
    if found is None:
        return None
    storage, tangent, part = found
    x, block = mean[:, storage], cov[:, tangent, tangent]
    if isinstance(part, SE2) and truth.heading is not None:
        real = np.column_stack([truth.position[:, :2], truth.heading])
    elif isinstance(part, SE3 | NavState) and truth.quaternion is not None:
        real, block = np.column_stack([truth.quaternion, truth.position]), block[:, :6, :6]
        x, part = x[:, :7], SE3() if isinstance(part, SE3) else part
    else:
        return None
    if isinstance(part, NavState):
        return None
    error = part.local(x, part.normalize(real))
    solved = np.linalg.solve(block, error[..., None])[..., 0]
    squared: Array = np.einsum("ni,ni->n", error, solved)
    return squared
