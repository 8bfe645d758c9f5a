"""From a filter and a model to a kernel that can be called once a sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.compile import Compiled, compiled
from sequential.errors import ModelError
from sequential.filters import (
    CubatureKalmanFilter,
    ExtendedKalmanFilter,
    IteratedExtendedKalmanFilter,
    KalmanFilter,
    UnscentedKalmanFilter,
)
from sequential.filters.kalman import require_linear
from sequential.filters.sigma_sets import SigmaSet
from sequential.model import StateSpace
from sequential.online.belief import Layout
from sequential.timeline import Schedule, sealed

__all__ = ["Handle", "handle"]

WHY_NOT = {
    "InteractingMultipleModel": "it mixes its models at the nodes of a log, which single samples do not have",
    "ParticleFilter": "its belief is a cloud of particles and not a mean with a covariance",
    "FixedLagSmoother": "it solves a window of the chain anew at every node of a log",
}


@dataclass(frozen=True, slots=True)
class Lowered:
    """What one filter needs to step: its kernel, scratch arrays, settings, and numbers beside the belief."""

    kernel: Any
    scratch: Any
    settings: tuple[Any, ...]
    form: str = "joseph"
    extra: int = 0


@dataclass(frozen=True, slots=True)
class Handle:
    """A kernel with its records in memory: `step(address, …)`.  Keeps the arrays behind the address alive."""

    step: Callable[..., int]
    address: int
    layout: Layout
    whole: Compiled
    alive: tuple[Any, ...] = field(repr=False)


def handle(estimator: Any, model: StateSpace) -> Handle:
    """Write the records of a filter and a model down, with scratch arrays of their own.

    Raises
    ------
    ModelError
        where the filter has no online form, or does not take the model.
    """
    made = lowered(estimator, model)  # first, since a filter may refuse the model
    from sequential.kernels.handles import words
    from sequential.kernels.records import Filtered

    whole = compiled(model)
    plan, slots = one_node(model)
    n, d, width = whole.tables.n, whole.tables.d, widest(model)
    filtered = Filtered(
        np.zeros((1, n)), np.zeros((1, d, d)), np.zeros((1, n)), np.zeros((1, d, d)), np.zeros((1, d, d)),
        np.zeros((1, width)), np.zeros((1, width, width)), np.zeros(1, dtype=np.int64),
    )  # fmt: skip
    record = (whole.tables, plan, slots, filtered, made.scratch, *made.settings)
    memory = words(record)
    # The compiled function itself: its dispatcher would look up the types of the arguments on every call.
    (entry,) = made.kernel.overloads.values()
    layout = Layout(model.manifold, width, made.form, made.extra)
    return Handle(entry.entry_point, memory.ctypes.data, layout, whole, (memory, record))


def widest(model: StateSpace) -> int:
    """Storage of the widest measurement."""
    return max([s.manifold.size for s in model.sensors.values()] + [1])


def one_node(model: StateSpace) -> tuple[Schedule, Any]:
    """A schedule of one node, one step and one reading, and its arrays to write to."""
    from sequential.kernels.slots import Slots

    sensors = list(model.sensors.values())
    width = widest(model)
    noise_cov = np.zeros((len(sensors) + 1, width, width))
    for k, sensor in enumerate(sensors):
        noise_cov[k, : sensor.manifold.dim, : sensor.manifold.dim] = sensor.noise_cov
    z = np.zeros((1, width))
    arrays: dict[str, NDArray[Any]] = {
        "step_ptr": np.zeros(2, dtype=np.int64),
        "step_dt": np.zeros(1),
        "step_input": np.zeros(1, dtype=np.int64),
        "inputs": np.zeros((1, max(1, model.process_functions.inputs))),
        "reading_ptr": np.zeros(2, dtype=np.int64),
        "sensor": np.zeros(1, dtype=np.int64),
        "z": z,
        "context": np.zeros((1, max([f.inputs for f in model.sensor_functions.values()] + [1]))),
        "z_flat": z[0],
        "noise_cov": noise_cov,
        "noise_row": np.zeros(1, dtype=np.int64),
        "rows": np.zeros(1, dtype=np.int64),
    }
    sizes = np.array([s.manifold.size for s in sensors], dtype=np.int64)
    own = {name: arrays[name] for name in Slots._fields if name not in {"z", "z_size"}}
    return Schedule(**arrays), Slots(**own, z=z[0], z_size=sizes)


@singledispatch
def lowered(estimator: Any, model: StateSpace) -> Lowered:
    """Lower a filter; registered for every one that has an online form."""
    name = type(estimator).__name__
    known = ", ".join(sorted(kind.__name__ for kind in lowered.registry if kind is not object))
    why = WHY_NOT.get(name, "it needs the whole log")
    msg = f"{name} has no online form: {why}; take one of {known}, or run({name}(…), model, log)"
    raise ModelError(msg)


@lowered.register
def _(estimator: KalmanFilter, model: StateSpace) -> Lowered:
    require_linear(model)
    return extended(model, estimator.form, 1)


@lowered.register
def _(estimator: ExtendedKalmanFilter, model: StateSpace) -> Lowered:
    return extended(model, estimator.form, 1)


@lowered.register
def _(estimator: IteratedExtendedKalmanFilter, model: StateSpace) -> Lowered:
    return extended(model, estimator.form, max(estimator.max_iterations, 2))


@lowered.register
def _(estimator: UnscentedKalmanFilter, model: StateSpace) -> Lowered:
    return sigma_points(model, estimator.set())


@lowered.register
def _(estimator: CubatureKalmanFilter, model: StateSpace) -> Lowered:
    return sigma_points(model, SigmaSet("cubature"))


def sigma_points(model: StateSpace, chosen: SigmaSet) -> Lowered:
    """A filter that carries a set of points through the models."""
    from sequential.kernels.online_sigma_points import sigma_points_step

    n, d = model.manifold.size, model.manifold.dim
    settings = (sealed(chosen.weights(d)), sealed(chosen.unit(d)))
    return Lowered(sigma_points_step, (np.zeros(n), np.zeros((d, d))), settings)


def extended(model: StateSpace, form: str, iterations: int) -> Lowered:
    """A filter that linearises, in one of its forms, plain or iterated."""
    n, d, width = model.manifold.size, model.manifold.dim, widest(model)
    if form == "joseph":
        from sequential.kernels.online_extended import extended_step, make_workspace

        return Lowered(extended_step, make_workspace(n, d, width), (iterations,))
    factors = (np.zeros(n), np.zeros((d, d)), np.zeros((d, d)), np.zeros(d))
    if form in {"ud", "sqrt"}:
        from sequential.kernels.factored import ROOT, UD
        from sequential.kernels.online_factored import factored_step

        settings = (UD if form == "ud" else ROOT, iterations)
        return Lowered(factored_step, factors, settings, form, d * d + d)
    from sequential.kernels.online_information import information_step

    return Lowered(information_step, factors, (), form, d * d + d)
