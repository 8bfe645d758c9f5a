"""A log and a model laid out in time: nodes, the steps between them, the readings at them.

Every estimator, recursive or graph, walks the same schedule, so that results can be compared node by node.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, GapError, MissingStreamError, ShapeError
from sequential.log import SensorLog, Stream, nanoseconds, seconds
from sequential.model import StateSpace

__all__ = ["Problem", "Schedule", "prepare"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MIN_GAP_S = 1.0
GAP_FACTOR = 100.0  # a pause of more than this many median sample intervals is a gap


class Schedule(NamedTuple):
    """Plain arrays that kernels walk.

    Node k is reached from node k-1 by the steps step_ptr[k]:step_ptr[k+1] and then takes the readings
    reading_ptr[k]:reading_ptr[k+1].  Node 0 is the prior's.
    """

    step_ptr: Ints  # (K+1,)
    step_dt: Array  # (S,) s
    step_input: Ints  # (S,) row of `inputs` that drives the step
    inputs: Array  # (N_u, max(1, inputs))
    reading_ptr: Ints  # (K+1,)
    sensor: Ints  # (M,) which sensor of the model
    z: Array  # (M, largest measurement)
    context: Array  # (M, largest context)
    z_flat: Array  # z once more, row after row


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What an estimator solves: a model, its schedule, and where each reading came from."""

    model: StateSpace
    schedule: Schedule
    t: Ints  # (K,) ns, time of each node
    reading_t: Ints  # (M,) ns
    reading_row: Ints  # (M,) row in the reading's stream
    log_name: str = "log"


def prepare(
    model: StateSpace, log: SensorLog, at: NDArray[np.generic] | None = None, max_gap: float | None = None
) -> Problem:
    """Lay out a log for a model.

    Parameters
    ----------
    at : further times at which an estimate is wanted, float seconds or int nanoseconds
    max_gap : longest pause of the input stream in seconds; by default the larger of 1 s and 100 intervals

    Raises
    ------
    MissingStreamError, GapError, ShapeError
    """
    log = log.check()
    start = log.span()[0] if model.start_ns is None else model.start_ns
    sensor, z, context, t, row = _readings(model, log, start)
    wanted = [t, np.array([start])] + ([] if at is None else [nanoseconds(at)])
    nodes = merged(*wanted)
    nodes = nodes[nodes >= start]
    order = np.argsort(t, kind="stable")
    reading_ptr = np.searchsorted(t[order], nodes, side="left")
    reading_ptr = np.append(reading_ptr, len(t)).astype(np.int64)
    steps = _steps(model, log, nodes, max_gap)
    ordered = (z[order], context[order], z[order].ravel())
    schedule = Schedule(*map(sealed, (*steps, reading_ptr, sensor[order], *ordered)))
    return Problem(model, schedule, nodes, t[order], row[order], log.name)


def merged(*stamps: Ints) -> Ints:
    """Distinct stamps of several ascending runs, in order; a stable sort merges runs in linear time."""
    together = np.sort(np.concatenate(stamps), kind="stable")
    return together[np.concatenate([[True], np.diff(together) > 0])] if len(together) else together


def sealed(values: NDArray[Any]) -> NDArray[Any]:
    """Contiguous and read-only, as kernels expect."""
    own = np.ascontiguousarray(values)
    own.flags.writeable = False
    return own


def _readings(model: StateSpace, log: SensorLog, start: int) -> tuple[Ints, Array, Array, Ints, Ints]:
    """All readings at or after `start`, sensor after sensor."""
    sizes = [s.manifold.size for s in model.sensors.values()] or [1]
    contexts = [max(1, f.inputs) for f in model.sensor_functions.values()] or [1]
    sensor, z, context, t, row = [], [], [], [], []
    for index, (name, model_of) in enumerate(model.sensors.items()):
        stream = log[name]
        _require_columns(name, stream, model_of.manifold.size, model.sensor_functions[name].inputs)
        kept = np.flatnonzero(stream.t >= start)
        if not len(kept):
            msg = f"log[{name!r}] has no reading at or after the start; drop the sensor or mend the log"
            raise MissingStreamError(msg)
        padded = np.zeros((len(kept), max(sizes)))
        padded[:, : stream.values.shape[1]] = stream.values[kept]
        known = np.zeros((len(kept), max(contexts)))
        if stream.context is not None:
            _require_landmarks(name, stream.context[:, 0], kept, getattr(model_of, "landmarks", None))
            width = min(stream.context.shape[1], known.shape[1])
            known[:, :width] = stream.context[kept, :width]
        sensor.append(np.full(len(kept), index))
        z.append(padded)
        context.append(known)
        t.append(stream.t[kept])
        row.append(kept)
    if not sensor:
        none = np.zeros(0, dtype=np.int64)
        return none, np.zeros((0, 1)), np.zeros((0, 1)), none, none
    return (
        np.concatenate(sensor).astype(np.int64),
        np.concatenate(z),
        np.concatenate(context),
        np.concatenate(t),
        np.concatenate(row).astype(np.int64),
    )


def _require_columns(name: str, stream: Stream, size: int, context: int) -> None:
    if stream.values.shape[1] != size:
        msg = f"log[{name!r}] has {stream.values.shape[1]} columns, the model takes {size}"
        raise ShapeError(msg)
    given = 0 if stream.context is None else stream.context.shape[1]
    if given < context:
        msg = f"log[{name!r}] needs {context} context columns (such as the landmark seen), it has {given}"
        raise ShapeError(msg)


def _require_landmarks(name: str, index: Array, kept: NDArray[Any], landmarks: Any) -> None:
    """A compiled sensor reads its table at the index in the context, so the index must be a row of it."""
    if landmarks is None:
        return
    seen, count = index[kept], len(landmarks)
    wrong = np.flatnonzero((seen != np.floor(seen)) | (seen < 0) | (seen >= count))
    if len(wrong):
        msg = (
            f"log[{name!r}] sees landmark {seen[wrong[0]]:g} at sample {kept[wrong[0]]}, but its sensor has "
            f"{count} landmarks, 0 to {count - 1}; mend the context or the sensor's table"
        )
        raise DataError(msg)


def _steps(
    model: StateSpace, log: SensorLog, nodes: Ints, max_gap: float | None
) -> tuple[Ints, Array, Ints, Array]:
    """Steps from node to node, cut at every input stamp."""
    if model.input is None:
        pointer = np.concatenate([[0, 0], np.arange(1, len(nodes))]).astype(np.int64)
        dt = np.diff(nodes) * 1e-9
        return pointer, dt, np.zeros(len(dt), dtype=np.int64), np.zeros((1, 1))
    stream = log[model.input]
    _require_columns(model.input, stream, model.process_functions.inputs, 0)
    if not len(stream):
        msg = f"log[{model.input!r}] drives the process and is empty"
        raise MissingStreamError(msg)
    _require_no_gap(model.input, stream, nodes, max_gap)
    inside = stream.t[(stream.t > nodes[0]) & (stream.t < nodes[-1])]
    edges = merged(inside, nodes)
    if stream.covers == "after":
        rows = np.searchsorted(stream.t, edges[:-1], side="right") - 1
    else:
        rows = np.searchsorted(stream.t, edges[1:], side="left")
    rows = np.clip(rows, 0, len(stream) - 1).astype(np.int64)
    pointer = np.searchsorted(edges, nodes).astype(np.int64)
    pointer = np.concatenate([[0], pointer])
    return pointer, np.diff(edges) * 1e-9, rows, np.ascontiguousarray(stream.values)


def _require_no_gap(name: str, stream: Stream, nodes: Ints, max_gap: float | None) -> None:
    first, last = nodes[0], nodes[-1]
    inner = stream.t[(stream.t > first) & (stream.t < last)]
    pauses = np.diff(np.concatenate([[first], inner, [last]])) * 1e-9
    usual = float(np.median(np.diff(stream.t))) * 1e-9 if len(stream) > 1 else 0.0
    limit = max(MIN_GAP_S, GAP_FACTOR * usual) if max_gap is None else max_gap
    if len(pauses) and pauses.max() > limit:
        k = int(np.argmax(pauses))
        began = seconds(first if k == 0 else inner[k - 1])
        msg = (
            f"log[{name!r}] drives the process but pauses for {pauses.max():.3f} s after {began:.3f} s "
            f"(usual interval {usual:.4f} s, limit {limit:.3f} s); cut the log there, "
            "or allow it with max_gap=…"
        )
        raise GapError(msg)
