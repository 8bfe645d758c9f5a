"""How far off an estimate is, and whether it says so: against held-out readings, or against the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets import Dataset, Truth
from sequential.evaluate import gap_labels, normalised_error
from sequential.history import Run
from sequential.jacobians import difference
from sequential.log import Stream
from sequential.manifold import SE2, SE3, NavState, Product, Vector
from sequential.model import StateSpace, evaluate
from sequential.models import ConstantAcceleration, ConstantVelocity, Position, Singer

__all__ = ["Errors", "errors_of", "has_position", "position_axes", "scored_sensor"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

TRUTH_BLOCK_S = 10.0  # errors against a dense truth are alike over seconds: one block of a bootstrap


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Errors at the moments where there is something to compare with.

    `against` is "held-out" (measured minus expected, covariance H P Hᵀ + R: the reading's own noise is in it)
    or "truth" (estimate minus truth in the world frame, covariance of the position).
    """

    t: Ints  # (M,) ns
    error: Array  # (M, m)
    cov: Array  # (M, m, m)
    block: Ints  # (M,) errors of one block are not independent of each other
    against: str
    metres: bool

    def __len__(self) -> int:
        return len(self.t)

    def rmse(self) -> float:
        """Root mean square of the length of the error."""
        return float(np.sqrt(np.mean(np.sum(self.error**2, axis=1))))

    def normalised(self) -> Array:
        """(M,) eᵀ S⁻¹ e."""
        return normalised_error(np.zeros_like(self.error), self.cov, self.error, np.zeros(self.cov.shape[1:]))


def errors_of(dataset: Dataset, model: StateSpace, run: Run) -> Errors | None:
    """Errors of a run against the held-out readings where there are any, else the truth, else None."""
    if dataset.held_out is not None and len(dataset.held_out):
        name = scored_sensor(model)
        return _against_held_out(model, name, dataset.held_out, dataset.log[name].t, run)
    if dataset.truth is not None:
        return _against_truth(dataset, dataset.truth, run)
    return None


def scored_sensor(model: StateSpace) -> str:
    """The sensor whose readings are held out: the first `Position`, or else the first of all."""
    names = list(model.sensors)
    return next((name for name in names if isinstance(model.sensors[name], Position)), names[0])


def has_position(dataset: Dataset) -> bool:
    """Whether the state says where something is, so that a map can be drawn."""
    return position_axes(dataset.model, dataset.truth) is not None


def position_axes(model: StateSpace, truth: Truth | None = None) -> int | None:
    """2 or 3, where the state has a pose, or a vector that a truth or a position sensor says is a place."""
    manifold = model.manifold
    parts = tuple(manifold.parts.values()) if isinstance(manifold, Product) else (manifold,)
    if any(isinstance(part, SE3 | NavState) for part in parts):
        return 3
    if any(isinstance(part, SE2) for part in parts):
        return 2
    if isinstance(model.process, ConstantVelocity | ConstantAcceleration | Singer):
        return model.process.axes if model.process.axes in {2, 3} else None
    seen = [sensor.axes for sensor in model.sensors.values() if isinstance(sensor, Position)]
    if seen:
        return seen[0]
    largest = max((part.size for part in parts if isinstance(part, Vector)), default=0)
    if truth is None or largest < 2:
        return None
    return 2 if largest < 3 or not truth.position[:, 2:].any() else 3


def _against_held_out(model: StateSpace, name: str, held: Stream, used: Ints, run: Run) -> Errors:
    sensor, lowered = model.sensors[name], model.sensor_functions[name]
    held = held.select(held.t >= run.t[0])
    known = np.zeros((len(held), max(1, lowered.inputs)))
    if held.context is not None:
        width = min(held.context.shape[1], known.shape[1])
        known[:, :width] = held.context[:, :width]
    residual, cov = [], []
    for node, z, u in zip(run.index(held.t), held.values, known, strict=True):
        r, H = _residual(lowered, sensor.manifold, run.manifold, run.mean[node], z, u)
        residual.append(r)
        cov.append(H @ run.cov[node] @ H.T + sensor.noise_cov)
    return Errors(
        held.t,
        np.array(residual),
        np.array(cov),
        gap_labels(held.t, used),
        "held-out",
        isinstance(sensor, Position),
    )


def _residual(f: Any, image: Any, domain: Any, x: Array, z: Array, u: Array) -> tuple[Array, Array]:
    """Measured minus expected (m,), and the sensor's Jacobian (m, d)."""

    def observe(at: Array) -> Array:
        return evaluate(f.value, at, u, 0.0, f.params, image.size)

    residual = image.local(observe(x), z)
    if f.jacobian is None:
        return residual, difference(observe, x, domain, image)
    return residual, evaluate(f.jacobian, x, u, 0.0, f.params, image.dim * domain.dim).reshape(image.dim, -1)


def _against_truth(dataset: Dataset, recorded: Truth, run: Run) -> Errors | None:
    rows, truth = recorded.at(run.t)
    if not len(rows):
        return None
    error = dataset.positions(run)[rows] - truth.position[:, : dataset.axes]
    block = ((truth.t - truth.t[0]) * 1e-9 // TRUTH_BLOCK_S).astype(np.int64)
    return Errors(truth.t, error, dataset.position_cov(run)[rows], block, "truth", metres=True)
