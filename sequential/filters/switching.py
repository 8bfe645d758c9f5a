"""Models that a system switches between: checked against each other, and stacked for the kernels."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.compile import compiled
from sequential.errors import DataError, ModelError, ShapeError
from sequential.model import StateSpace
from sequential.timeline import Problem, sealed

__all__ = ["require_family", "stack", "transitions_of"]

Array = NDArray[np.float64]


def require_family(models: Sequence[StateSpace]) -> None:
    """Refuse models that do not describe the same system.

    Raises
    ------
    ModelError
    """
    if not models or not all(isinstance(model, StateSpace) for model in models):
        raise ModelError("give models=(…), one StateSpace for each way in which the system may behave")
    first = models[0]
    for index, model in enumerate(models[1:], 1):
        if model.manifold != first.manifold:
            raise ModelError(
                f"the models must share one state: model 0 lives on {first.manifold}, "
                f"model {index} on {model.manifold}"
            )
        if set(model.sensors) != set(first.sensors):
            raise ModelError(
                f"the models must name the same sensors: model 0 has {sorted(first.sensors)}, "
                f"model {index} has {sorted(model.sensors)}"
            )
        for name, sensor in first.sensors.items():
            if model.sensors[name].manifold != sensor.manifold:
                raise ModelError(
                    f"sensor {name!r} reads on {sensor.manifold} in model 0 and on "
                    f"{model.sensors[name].manifold} in model {index}"
                )
        if model.start_ns != first.start_ns:
            raise ModelError(f"the prior of model {index} does not hold at the time of model 0's; see start=")


def stack(problem: Problem, models: Sequence[StateSpace]) -> tuple[Any, list[Any]]:
    """The kernels' `Modes` record of models, and what keeps their compiled functions alive.

    Raises
    ------
    ModelError, ShapeError, DataError
        where a model cannot walk the schedule of the problem's own.
    """
    from sequential.kernels.modes import Modes

    if not any(problem.model is model for model in models):
        raise ModelError("run(…) was given a model that is not among the models=(…) of the estimator")
    same = [_in_order(problem.model, model) for model in models]
    for model in same:
        _require_schedule(problem, model)
    alive = [compiled(model) for model in same]
    tables = [whole.tables for whole in alive]
    gate = np.stack([t.gate for t in tables])
    entries = (
        np.array([[t.step, t.jacobian, t.noise, t.advance, t.carry] for t in tables], dtype=np.int64),
        _padded([t.params for t in tables]),
        np.stack([t.observe for t in tables]),
        np.stack([t.observe_jacobian for t in tables]),
        _padded([t.sensor_params for t in tables]),
        np.stack([t.sensor_params_at for t in tables]),
        np.stack([replace(problem, model=model).schedule.noise_cov for model in same]),
        gate,
        np.stack([t.loss for t in tables]),
        np.stack([t.loss_k for t in tables]),
        np.full(gate.shape[1:], -1.0),
        np.full(gate.shape[1:], np.inf),
        np.stack([t.see for t in tables]),
    )
    return Modes(*map(sealed, entries)), [alive, same]


def _in_order(first: StateSpace, model: StateSpace) -> StateSpace:
    """The model with its sensors in the order of the first."""
    if list(model.sensors) == list(first.sensors):
        return model
    other = copy.copy(model)
    for name in ("sensors", "sensor_functions"):
        found = getattr(model, name)
        object.__setattr__(other, name, {sensor: found[sensor] for sensor in first.sensors})
    return other


def _require_schedule(problem: Problem, model: StateSpace) -> None:
    plan, own = problem.schedule, problem.model
    if model.input not in {None, own.input}:
        raise ModelError(
            f"one model is driven by {model.input!r}, but the log was laid out for {own.input!r}; "
            "give run(…) the model that has the input"
        )
    if model.input is not None and model.process_functions.inputs > plan.inputs.shape[1]:
        raise ShapeError(
            f"a model takes {model.process_functions.inputs} inputs, log[{model.input!r}] has "
            f"{plan.inputs.shape[1]}"
        )
    if model.input is not None:
        model.process.require_inputs(plan.inputs, f"log[{model.input!r}]")
    for index, (name, functions) in enumerate(model.sensor_functions.items()):
        rows = plan.sensor == index
        if functions.inputs > own.sensor_functions[name].inputs:
            raise ShapeError(
                f"sensor {name!r} takes {functions.inputs} context columns in one model and "
                f"{own.sensor_functions[name].inputs} in the one that the log was laid out for"
            )
        landmarks = getattr(model.sensors[name], "landmarks", None)
        if landmarks is not None and rows.any() and plan.context[rows, 0].max() >= len(landmarks):
            raise DataError(
                f"log[{name!r}] sees landmark {plan.context[rows, 0].max():g}; one model has "
                f"{len(landmarks)} of them only"
            )


def _padded(rows: list[Array]) -> Array:
    out = np.zeros((len(rows), max(map(len, rows))))
    for k, row in enumerate(rows):
        out[k, : len(row)] = row
    return out


def transitions_of(
    t: NDArray[np.int64], count: int, transition: ArrayLike | None, rate: ArrayLike | None
) -> Array:
    """(K, J, J) chances of switching on the way to each node, entry [k, i, j] from model i to model j.

    Parameters
    ----------
    t : (K,) ns
    transition : (J, J) for every node, or the chance of staying
    rate : (J, J) per second, rows adding up to zero, or the rate of leaving: the matrix exponential of it
        holds over a pause (Kolmogorov's equation)

    Raises
    ------
    ModelError, ShapeError
    """
    if (transition is None) == (rate is None):
        raise ModelError("give transition=… for every node, or switching_rate=… per second: one of the two")
    if transition is not None:
        matrix = np.broadcast_to(_chances(transition, count), (len(t), count, count)).copy()
    else:
        from scipy.linalg import expm

        pauses, which = np.unique(np.diff(t), return_inverse=True)
        over = expm(_rates(rate, count) * (pauses * 1e-9)[:, None, None]) if len(pauses) else np.eye(count)
        matrix = np.concatenate([np.eye(count)[None], over.reshape(-1, count, count)[which]])
    matrix[0] = np.eye(count)  # no time passes before the prior's node
    return matrix


def _chances(given: ArrayLike, count: int) -> Array:
    matrix = np.asarray(given, dtype=np.float64)
    if matrix.ndim == 0:
        others = np.full((count, count), (1.0 - matrix) / max(count - 1, 1))
        np.fill_diagonal(others, matrix if count > 1 else 1.0)
        matrix = others
    if matrix.shape != (count, count):
        raise ShapeError(
            f"a transition matrix between {count} models is ({count}, {count}), got {matrix.shape}"
        )
    if not (np.all(matrix >= 0.0) and np.allclose(matrix.sum(axis=1), 1.0, atol=1e-9)):
        raise ModelError("every row of a transition matrix holds chances, zero or more, that add up to 1")
    return matrix


def _rates(given: ArrayLike | None, count: int) -> Array:
    matrix = np.asarray(given, dtype=np.float64)
    if matrix.ndim == 0:
        others = np.full((count, count), matrix / max(count - 1, 1))
        np.fill_diagonal(others, -matrix if count > 1 else 0.0)
        matrix = others
    if matrix.shape != (count, count):
        raise ShapeError(f"switching rates between {count} models are ({count}, {count}), got {matrix.shape}")
    off = matrix - np.diag(np.diagonal(matrix))
    scale = max(1.0, float(np.abs(matrix).max()))
    if not (np.all(off >= 0.0) and np.allclose(matrix.sum(axis=1), 0.0, atol=1e-9 * scale)):
        raise ModelError(
            "switching rates are zero or more off the diagonal, and every row adds up to 0: the diagonal "
            "holds minus the rate of leaving"
        )
    return matrix
