"""Logs whose truth is known: a model's own process and sensors, with its own noise, drawn once.

Truth and readings come from the declaration that estimators take, so what they then claim about
themselves (NEES, NIS, bands) can be held against many such draws.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import MissingStreamError, ModelError, ShapeError, TimeOrderError
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.model import StateSpace, evaluate

__all__ = ["Simulation", "simulate"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Simulation(NamedTuple):
    """One draw: what the sensors said, and what was so."""

    log: SensorLog
    t: Ints  # (N,) ns
    truth: Array  # (N, n)


def simulate(
    model: StateSpace,
    t: ArrayLike,
    rng: np.random.Generator,
    *,
    inputs: ArrayLike | None = None,
    readings: Mapping[str, ArrayLike | int] | None = None,
    contexts: Mapping[str, ArrayLike] | None = None,
    name: str = "simulated",
) -> Simulation:
    """Draw a truth from the prior and the process, and readings of it.

    Parameters
    ----------
    model : its prior is the belief at t[0]
    t : (N,) times of the truth, float seconds or int nanoseconds
    rng : the only source of chance
    inputs : (N, k) or (N-1, k) what drives the process from each time to the next, known exactly
    readings : by sensor, rows of `t` at which it reads, or every how many rows; every row unless given
    contexts : by sensor, (c,) for every reading, or (M, c) one row for each

    Raises
    ------
    TimeOrderError
        where t does not increase.
    ShapeError
        where inputs or contexts have the wrong shape.
    ModelError
        where the model's start is not t[0], or would be taken to be a later reading.
    """
    stamps = np.atleast_1d(nanoseconds(t))
    if len(stamps) < 2 or not (np.diff(stamps) > 0).all():
        raise TimeOrderError("simulate needs two times or more, each after the one before")
    driven = _inputs(model, len(stamps), inputs)
    truth = _truth(model, stamps, driven, rng)
    streams: dict[str, Stream] = {}
    if model.input is not None:
        streams[model.input] = Stream(stamps[: len(driven)], driven)
    for sensor in model.sensors:
        rows = _rows((readings or {}).get(sensor, 1), len(stamps))
        streams[sensor] = _stream(model, sensor, stamps[rows], truth[rows], (contexts or {}).get(sensor), rng)
    start = model.start_ns if model.start_ns is not None else min(int(s.t[0]) for s in streams.values())
    if start != stamps[0]:
        raise ModelError(
            f"the model's prior holds at {start * 1e-9:.6f} s but the simulation begins at "
            f"{stamps[0] * 1e-9:.6f} s; give the StateSpace start={stamps[0] * 1e-9:g}"
        )
    return Simulation(SensorLog(streams, name), stamps, truth)


def _inputs(model: StateSpace, count: int, inputs: ArrayLike | None) -> Array:
    width = model.process_functions.inputs
    if model.input is None:
        return np.zeros((count, 1))
    if inputs is None:
        raise MissingStreamError(
            f"the process is driven by {model.input!r}; give simulate inputs=… of shape (N, {width})"
        )
    given = np.asarray(inputs, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != width or len(given) not in {count - 1, count}:
        raise ShapeError(
            f"inputs must have shape ({count}, {width}) or ({count - 1}, {width}), got {given.shape}"
        )
    return given


def _truth(model: StateSpace, stamps: Ints, driven: Array, rng: np.random.Generator) -> Array:
    f, manifold, prior = model.process_functions, model.manifold, model.prior
    x = manifold.retract(prior.mean, root(prior.cov) @ rng.standard_normal(manifold.dim))
    path, known = [x], dict[float, Array]()
    steady = model.process.linear and not getattr(model.process, "rows", 0)
    for k, dt in enumerate(np.diff(stamps) * 1e-9):
        ahead = evaluate(f.value, x, driven[k], float(dt), f.params, manifold.size)
        # a linear process without a table has the same noise in steps of the same length
        spread = known.get(float(dt)) if steady else None
        if spread is None:
            spread = known[float(dt)] = _spread(model, x, driven[k], float(dt))
        x = manifold.retract(ahead, spread @ rng.standard_normal(manifold.dim))
        path.append(x)
    return np.stack(path)


def _spread(model: StateSpace, x: Array, u: Array, dt: float) -> Array:
    """A root of the process noise of one step (d, d)."""
    f, d = model.process_functions, model.manifold.dim
    if f.noise is None:
        return np.zeros((d, d))
    return root(evaluate(f.noise, x, u, dt, f.params, d * d).reshape(d, d))


def _rows(given: ArrayLike | int, count: int) -> Ints:
    if isinstance(given, int):
        return np.arange(0, count, given)
    return np.asarray(given, dtype=np.int64)


def _stream(
    model: StateSpace, name: str, t: Ints, truth: Array, context: ArrayLike | None, rng: np.random.Generator
) -> Stream:
    f, sensor = model.sensor_functions[name], model.sensors[name]
    known = np.zeros((len(t), max(f.inputs, 1)))
    if f.inputs:
        if context is None:
            raise MissingStreamError(
                f"sensor {name!r} needs a context (such as the landmark seen); give contexts=…"
            )
        known = np.array(np.broadcast_to(np.asarray(context, dtype=np.float64), (len(t), f.inputs)))
    seen = np.stack(
        [
            evaluate(f.value, x, u, 0.0, f.params, sensor.manifold.size)
            for x, u in zip(truth, known, strict=True)
        ]
    )
    noise = rng.standard_normal((len(t), sensor.manifold.dim)) @ root(sensor.noise_cov).T
    return Stream(t, sensor.manifold.retract(seen, noise), known if f.inputs else None)


def root(cov: Array) -> Array:
    """A (d, d) with A Aᵀ = cov, for any positive semi-definite covariance."""
    values, vectors = np.linalg.eigh(cov)
    scaled: Array = vectors * np.sqrt(np.clip(values, 0.0, None))
    return scaled
